# The workspace of an author, and the arena: VRG's image with a repository that has a player and a match to begin with.
FROM vrg
USER root
RUN apt-get update -qq \
    && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends git \
    && rm -rf /var/lib/apt/lists/*
RUN git config --global user.email player@codeclash.com && git config --global user.name Player \
    && git init --quiet --bare --initial-branch=main /srv/vrg.git && git clone --quiet /srv/vrg.git /workspace \
    && cd /workspace && git checkout --quiet -b main && vrg new player player && vrg new match match \
    && printf '__pycache__/\nruns/\n' > .gitignore \
    && git add --all && git commit --quiet -m "A player to begin with" && git push --quiet origin main
WORKDIR /workspace
ENTRYPOINT []
