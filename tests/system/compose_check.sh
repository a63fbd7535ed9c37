#!/usr/bin/env bash
# Builds the image, runs a short test in three containers, and reads the recording that it leaves.
#
#   tests/system/compose_check.sh [--start-engine]
#
# --start-engine   where no container engine runs: start dockerd (as root) for the time of the check
#
# BASE_IMAGE   image to build on; without it a Debian system with Python is made (debootstrap, as root)
# BASE_TAR     that system as a tar file: used if it is there, else made and kept there
# RTHS_ARGS    options of the test, the same for all three (default: --duration 4)
# LIMIT        seconds that the test may take (default: 120)
# PYTHON       Python 3.11 with pip that fetches the locked packages (default: the checkout's .venv)
# RTHS         the command that reads the recording (default: the checkout's .venv)
#
# Exit codes: 0 passed, 1 failed, 2 bad usage, 77 skipped for want of an engine, compose or a base.
set -eu -o pipefail

root=$(cd "$(dirname "$0")/../.." && pwd)
python=${PYTHON:-$root/.venv/bin/python}
rths=${RTHS:-$root/.venv/bin/rths}
limit=${LIMIT:-120}
tag=$$
work=$(mktemp -d)
context=$work/context
started=
bridge_was_there=

say() { printf 'compose_check: %4d s: %s\n' "$SECONDS" "$*"; }
skip() { say "skipped: $*"; exit 77; }
fail() { say "failed: $*"; exit 1; }
has() { command -v "$1" > /dev/null 2>&1; }

cleanup() {
    local code=$?
    trap - EXIT
    set +e
    if [ -f "$context/docker-compose.yml" ] && [ -n "${compose+x}" ]; then
        if [ "$code" -eq 1 ]; then in_context "${compose[@]}" logs --no-color; fi
        in_context "${compose[@]}" down --volumes --timeout 5 > "$work/down.log" 2>&1
    fi
    if [ -n "$started" ]; then
        stop_engine
    elif [ -n "${RTHS_IMAGE:-}" ]; then
        docker image rm "$RTHS_IMAGE" "rths-base:$tag" > /dev/null 2>&1
    fi
    rm -rf --one-file-system "$work"
    exit "$code"
}

in_context() { (cd "$context" && "$@"); }

# The engine leaves the machine's firewall and forwarding alone: the test's own network needs neither.
# BuildKit needs the default bridge, which is removed again.
start_engine() {
    if [ -e /sys/class/net/docker0 ]; then bridge_was_there=yes; fi
    export DOCKER_HOST=unix://$work/docker.sock
    setsid nice dockerd --host "$DOCKER_HOST" --pidfile "$work/dockerd.pid" \
        --data-root "$work/data" --exec-root "$work/exec" \
        --iptables=false --ip6tables=false --ip-forward=false --ip-masq=false \
        > "$work/dockerd.log" 2>&1 &
    started=$!
    for _ in $(seq 60); do
        if docker info > /dev/null 2>&1; then return; fi
        if ! kill -0 "$started" 2> /dev/null; then break; fi
        sleep 0.5
    done
    tail -n 20 "$work/dockerd.log"
    fail "dockerd does not start"
}

stop_engine() {
    kill "$started" 2> /dev/null
    for _ in $(seq 60); do
        kill -0 "$started" 2> /dev/null || break
        sleep 0.5
    done
    kill -9 "$started" 2> /dev/null
    awk -v under="$work/" 'index($2, under) == 1 {print $2}' /proc/mounts | sort -r | xargs -r umount
    [ -n "$bridge_was_there" ] || ip link delete docker0 2> /dev/null
}

make_base() {
    BASE_IMAGE=rths-base:$tag
    local tar=${BASE_TAR:-$work/base.tar} system=$work/system
    if [ ! -f "$tar" ]; then
        [ "$(id -u)" -eq 0 ] || skip "making a base image needs root; give BASE_IMAGE or BASE_TAR"
        has debootstrap || skip "no BASE_IMAGE, no BASE_TAR and no debootstrap to make one"
        say "making a base image"
        nice debootstrap --variant=minbase --include=python3,python3-venv bookworm "$system" > "$work/debootstrap.log" 2>&1 ||
            { tail -n 20 "$work/debootstrap.log"; fail "debootstrap"; }
        tar -C "$system" --one-file-system --numeric-owner --exclude='./var/cache/apt/*' --exclude='./var/lib/apt/lists/*' \
            --exclude='./usr/share/doc/*' --exclude='./usr/share/locale/*' --exclude='./usr/share/man/*' -cf "$tar.part" .
        mv "$tar.part" "$tar"
        rm -rf --one-file-system "$system"
    fi
    docker import "$tar" "$BASE_IMAGE" > /dev/null
    say "base image from ${BASE_TAR:-debootstrap}"
}

case "${1:-}" in
    '' | --start-engine) ;;
    *) sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "$0"; rm -rf "$work"; exit 2 ;;
esac
trap cleanup EXIT
trap 'exit 1' INT TERM

has docker || skip "no docker command"
if docker compose version > /dev/null 2>&1; then
    compose=(docker compose)
elif has docker-compose; then
    compose=(docker-compose)
else
    skip "neither 'docker compose' nor docker-compose"
fi
if ! docker info > /dev/null 2>&1; then
    [ "${1:-}" = --start-engine ] || skip "no container engine runs; as root, --start-engine starts one"
    [ "$(id -u)" -eq 0 ] || skip "starting an engine needs root"
    has dockerd || skip "no dockerd to start"
    start_engine
fi
say "engine $(docker version --format '{{.Server.Version}}'), ${compose[*]} $("${compose[@]}" version --short)"

[ -n "${BASE_IMAGE:-}" ] || make_base
export BASE_IMAGE
export RTHS_IMAGE=rths-check:$tag COMPOSE_PROJECT_NAME=rths-check-$tag RTHS_ARGS=${RTHS_ARGS---duration 4}

mkdir -p "$context/wheels"
tar -C "$root" --exclude='./.git' --exclude='./.venv' --exclude='./.*_cache' --exclude='./.hypothesis' \
    --exclude='./build' --exclude='./runs' --exclude='__pycache__' --exclude='*.egg-info' -cf - . | tar -C "$context" -xf -
"$python" -m pip download --quiet --no-deps --only-binary :all: --require-hashes \
    --requirement "$root/requirements.lock" --dest "$context/wheels" 2> "$work/pip.log" ||
    { tail -n 5 "$work/pip.log"; fail "the locked packages cannot be fetched"; }
say "build context $(du -sh "$context" | cut -f 1)"

in_context "${compose[@]}" build > "$work/build.log" 2>&1 || { tail -n 30 "$work/build.log"; fail "build"; }
say "image of $(($(docker image inspect --format '{{.Size}}' "$RTHS_IMAGE") / 1000000)) MB"

# An engine that lacks the privilege to raise limits (rootless, a sandbox) refuses containers that ask for it.
if docker run --rm --ulimit rtprio=95 --ulimit memlock=-1 "$RTHS_IMAGE" true > /dev/null 2>&1; then
    compose+=(-f docker-compose.yml -f docker-compose.realtime.yml)
    say "this engine can raise limits: the laboratories get real-time rights"
else
    say "this engine cannot raise limits: the services run without rights"
fi

in_context "${compose[@]}" up -d > "$work/up.log" 2>&1 || { tail -n 30 "$work/up.log"; fail "up"; }
say "test runs: ${RTHS_ARGS:-no options}"
deadline=$((SECONDS + limit))
codes=
for role in master slave recorder; do
    container=$(in_context "${compose[@]}" ps -a -q "$role")
    [ -n "$container" ] || fail "no container of the $role"
    left=$((deadline - SECONDS))
    code=$(timeout "$((left > 1 ? left : 1))" docker wait "$container") || fail "the $role did not end within $limit s"
    say "$role ended with exit code $code"
    codes=$codes$code
done
[ "$codes" = 000 ] || fail "not every part of the test ended with exit code 0"

shopt -s nullglob
recordings=("$context"/runs/*.mcap)
[ "${#recordings[@]}" -eq 1 ] || fail "${#recordings[@]} recordings in the mounted folder, not one"
"$rths" inspect "${recordings[0]}" --json > "$work/inspect.json" || fail "rths inspect"
"$python" - "$work/inspect.json" << 'EOF' || fail "the recording is not that of a whole test"
import json, sys
from pathlib import Path
seen = json.loads(Path(sys.argv[1]).read_text())
whole = seen["finished"] and all(topic["missing"] == 0 for topic in seen["topics"].values())
if not whole:
    print(json.dumps({"finished": seen["finished"], "topics": seen["topics"]}, indent=1))
sys.exit(not whole)
EOF
say "passed: $(basename "${recordings[0]}"), $(stat -c %s "${recordings[0]}") bytes"
