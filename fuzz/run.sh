#!/bin/sh
# Fuzz the readers of glTF and of images, one after the other: fuzz/run.sh [SECONDS in all]. Needs
# clang with libFuzzer; says so and leaves without. A crash is written to build-fuzz/crashes and
# fails the run.
set -eu
seconds=${1:-60}
root=$(cd "$(dirname "$0")/.." && pwd)
build=$root/build-fuzz

skip() {
    echo "fuzz: SKIPPED: $1"
    exit 77
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM

command -v clang >/dev/null && command -v clang++ >/dev/null || skip "clang is not installed"
echo 'int LLVMFuzzerTestOneInput(const char *data, unsigned long size) { return data && size > ~0ul - 1; }' >"$work/probe.c"
clang -fsanitize=fuzzer,address,undefined "$work/probe.c" -o "$work/probe" 2>/dev/null ||
    skip "clang has no fuzzer or sanitizer runtime (package libclang-rt-dev)"

cmake -S "$root" --preset fuzz >"$work/configure.log" 2>&1 || {
    cat "$work/configure.log" >&2
    exit 1
}
cmake --build "$build" --target fuzz_gltf fuzz_image

mkdir -p "$build/crashes"

# fuzz NAME SHARE_OF_FOUR [OPTIONS]
fuzz() {
    name=$1
    time=$((seconds * $2 / 4 + 1))
    shift 2
    mkdir "$work/$name"
    "$build/fuzz/fuzz_$name" "$work/$name" "$root/fuzz/$name/seeds" \
        -artifact_prefix="$build/crashes/" -max_total_time="$time" \
        -rss_limit_mb=1024 -malloc_limit_mb=512 -timeout=10 \
        -max_len=8192 -print_final_stats=1 -verbosity=1 "$@" 2>"$work/fuzz.log" || {
        tail -n 80 "$work/fuzz.log" >&2
        echo "fuzz: $name: a crash; the input is in $build/crashes" >&2
        exit 1
    }
    echo "fuzz: $name"
    grep -E '^(Done|stat::number_of_executed_units|stat::peak_rss_mb)' "$work/fuzz.log" || true
}

fuzz gltf 3 -dict="$root/fuzz/gltf/gltf.dict"
fuzz image 1
