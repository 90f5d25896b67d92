"""The keys of a match's seats: certificates, the files that they are kept in, and whom they belong to."""
