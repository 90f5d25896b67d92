#!/usr/bin/env bash
# A league in a git repository: authors put their entries into a folder of it by pull requests.
#
#   league.sh check BASE    does with each entry that differs from the commit BASE what the league does
#   league.sh play          plays, and commits the league to a branch of its own, with its pages
#
# Both run in a clone of the repository. What may be set: VRG_ENTRIES, the folder of the entries (entries); VRG_MATCH, a
# game or a match file (sharks-and-minnows); VRG_GAMES, the games of a call (60); VRG_BRANCH, the branch (league);
# VRG_PAGES, a folder into which the pages are copied (public); VRG_PUSH, where the branch is pushed to (origin).
set -euo pipefail
entries=${VRG_ENTRIES:-entries} match=${VRG_MATCH:-sharks-and-minnows} branch=${VRG_BRANCH:-league}

check() {
    local status=0 changed entry
    changed=$(git -c core.quotePath=off diff --name-only --diff-filter=d "$1"...HEAD -- "$entries" | cut -d/ -f"1-$(($(tr -cd / <<<"$entries" | wc -c) + 2))" | sort -u)
    [ -n "$changed" ] || echo "no entry in $entries differs from $1"
    while IFS= read -r entry; do
        [ -z "$entry" ] || vrg league check "$entry" --match "$match" || status=1
    done <<<"$changed"
    return "$status"
}

play() {
    local place=.league pages=${VRG_PAGES:-public} own
    own=$(git rev-parse --git-path info/exclude)
    mkdir -p "$(dirname "$own")"
    for name in "$place" "$pages"; do grep -qxF "/$name" "$own" 2>/dev/null || echo "/$name" >>"$own"; done
    git fetch --quiet origin "+refs/heads/$branch:refs/remotes/origin/$branch" 2>/dev/null || true
    git worktree remove --force "$place" 2>/dev/null || true
    if git rev-parse --verify --quiet "origin/$branch" >/dev/null; then
        git worktree add --quiet --force -B "$branch" "$place" "origin/$branch"
    else
        git worktree add --quiet --force --detach "$place"
        git -C "$place" checkout --quiet --orphan "$branch"
        git -C "$place" rm -rfq --ignore-unmatch .
    fi
    vrg league play "$entries" --output "$place/league" --games "${VRG_GAMES:-60}" --match "$match" --new-release
    mkdir -p "$pages"
    cp -r "$place"/league/pages/. "$pages"
    # The league keeps itself out of git by a .gitignore of its own.
    git -C "$place" add --force --all league
    git -C "$place" commit --quiet --message "Play until $(date -u +%Y-%m-%dT%H:%MZ)"
    git -C "$place" push --quiet "${VRG_PUSH:-origin}" "HEAD:refs/heads/$branch"
}

case "${1:-}" in
check) check "${2:?expected the commit with which to compare, such as origin/main}" ;;
play) play ;;
*) echo "league.sh: expected check or play, got ${1:-nothing}" >&2; exit 2 ;;
esac
