#!/bin/sh
# Fuzz the glTF reader: fuzz/run.sh [SECONDS]. Needs clang with libFuzzer; says so and leaves
# without. A crash is written to build-fuzz/crashes and fails the run.
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
cmake --build "$build" --target fuzz_gltf

mkdir "$work/corpus"
mkdir -p "$build/crashes"
"$build/fuzz/fuzz_gltf" "$work/corpus" "$root/fuzz/gltf/seeds" \
    -dict="$root/fuzz/gltf/gltf.dict" -artifact_prefix="$build/crashes/" \
    -max_total_time="$seconds" -rss_limit_mb=1024 -malloc_limit_mb=512 -timeout=10 \
    -max_len=8192 -print_final_stats=1 -verbosity=1 2>"$work/fuzz.log" || {
    tail -n 80 "$work/fuzz.log" >&2
    echo "fuzz: a crash; the input is in $build/crashes" >&2
    exit 1
}
grep -E '^(Done|stat::number_of_executed_units|stat::peak_rss_mb)' "$work/fuzz.log" || true
