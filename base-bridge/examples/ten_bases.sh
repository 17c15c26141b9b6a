#!/bin/sh
# Ten simulated bases on this computer's ROS 2 network, r1 to r10, each in a namespace of its own. Ctrl-C ends all of them.
#
#     base-bridge/examples/ten_bases.sh [OPTION OF base-bridge]…
#
# BASES: how many; BRIDGE: the program, if it is built already.
set -eu
cd "$(dirname "$0")/../.."
if [ -z "${BRIDGE:-}" ]; then
    cargo build --release --package base-bridge --features dds
    BRIDGE=target/release/base-bridge
fi
processes=
# The signal that ends this script ends the bases, and they stop before they go.
trap 'kill $processes 2>/dev/null; wait; exit 0' INT TERM
for n in $(seq "${BASES:-10}"); do
    "$BRIDGE" --sim --seed "$n" --namespace "r$n" --params-file base-bridge/examples/fleet.yaml -p "frames.prefix:=r$n/" "$@" &
    processes="$processes $!"
done
wait
