"""The match in a browser: a static page, and a server that shows it to viewers, an official and drivers of players."""
