#!/bin/sh
# install.sh STEP SOURCE BUILD LIBDIR CC CXX CMAKE: what cmake --install gives, seen by a user.
# Works in BUILD/tests/installed. The step `prefix` comes first.
set -eu
step=$1 source=$2 build=$3 libdir=$4 cc=$5 cxx=$6 cmake=$7
work=$build/tests/installed
prefix=$work/prefix
lib=$prefix/$libdir

die() {
    echo "install: $*" >&2
    exit 1
}

make_prefix() {
    rm -rf "$work"
    mkdir -p "$work"
    "$cmake" --install "$build" --prefix "$work/elsewhere" >/dev/null
    # Moved, so that nothing can depend on the place it was installed to.
    mv "$work/elsewhere" "$prefix"
    for file in bin/cranny include/cranny/cranny.h "$libdir/libcranny.so" "$libdir/libcranny.so.0" \
        "$libdir/libcranny.a" "$libdir/libcranny-screen.so.0" "$libdir/libcranny-screen.a" \
        "$libdir/pkgconfig/cranny.pc" "$libdir/pkgconfig/cranny-screen.pc" "$libdir/cmake/cranny/cranny-config.cmake"; do
        [ -e "$prefix/$file" ] || die "$file was not installed"
    done
    "$prefix/bin/cranny" --version
}

# Every public header alone, as C and as C++.
check_headers() {
    count=0
    for header in "$prefix"/include/cranny/*.h; do
        name=cranny/$(basename "$header")
        printf '#include <%s>\n' "$name" >"$work/header.c"
        cp "$work/header.c" "$work/header.cc"
        "$cc" -std=c17 -Wall -Wextra -Wundef -Wstrict-prototypes -Werror -I"$prefix/include" \
            -fsyntax-only "$work/header.c" || die "$name does not compile alone as C"
        if [ -n "$cxx" ]; then
            "$cxx" -std=c++17 -Wall -Wextra -Wundef -Werror -I"$prefix/include" \
                -fsyntax-only "$work/header.cc" || die "$name does not compile alone as C++"
        fi
        count=$((count + 1))
    done
    [ "$count" -ge 4 ] || die "only $count headers"
}

# The shared library exports the headers' functions and nothing else.
check_symbols() {
    nm -D --defined-only "$lib/libcranny.so" | awk '{print $3}' | sed 's/@.*//' | sort >"$work/exported"
    others=$(grep -v '^cranny_' "$work/exported" || true)
    [ -z "$others" ] || die "exports what is not cranny_: $others"
    cat "$prefix"/include/cranny/*.h | grep -v '^#' | tr '\n' ' ' | grep -o 'CRANNY_API [^;]*;' |
        grep -o 'cranny_[a-z0-9_]* *(' | tr -d ' (' | sort -u >"$work/declared"
    [ "$(wc -l <"$work/declared")" -ge 20 ] || die "too few declarations found"
    missing=$(comm -23 "$work/declared" "$work/exported")
    [ -z "$missing" ] || die "declared but not exported: $missing"
}

check_package() {
    "$cmake" -S "$source/tests/install" -B "$work/package" -DCMAKE_PREFIX_PATH="$prefix" \
        -DCMAKE_C_COMPILER="$cc" -DCMAKE_BUILD_TYPE=Release >"$work/package.log" 2>&1 ||
        { cat "$work/package.log" >&2; die "find_package failed"; }
    "$cmake" --build "$work/package" >"$work/package.log" 2>&1 ||
        { cat "$work/package.log" >&2; die "the package does not link"; }
    "$work/package/user-cranny"
    "$work/package/user-cranny-static"
    readelf -d "$work/package/user-cranny" | grep -q libcranny.so.0 || die "not linked to libcranny.so.0"
    ! readelf -d "$work/package/user-cranny-static" | grep -q libcranny || die "not linked statically"
}

check_pkgconfig() {
    PKG_CONFIG_PATH=$lib/pkgconfig
    export PKG_CONFIG_PATH
    main=$source/tests/install/main.c
    "$cc" -std=c17 "$main" $(pkg-config --cflags --libs cranny) -o "$work/pc-shared"
    LD_LIBRARY_PATH=$lib "$work/pc-shared"
    # The archive is found first, as where no shared library was installed.
    mkdir -p "$work/static"
    cp "$lib/libcranny.a" "$work/static"
    "$cc" -std=c17 "$main" -L"$work/static" $(pkg-config --static --cflags --libs cranny) \
        -o "$work/pc-static"
    "$work/pc-static"
    ! readelf -d "$work/pc-static" | grep -q libcranny || die "not linked statically"
}

# Whoever links `file` gets neither rays nor scenes along with it.
check_light() {
    ! readelf -d "$1" | grep -E 'NEEDED.*(embree|assimp|tbb|draco)' || die "$1 needs what only rays need"
    ! ldd "$1" | grep -E 'embree|assimp|tbb|draco' || die "$1 loads what only rays need"
}

# The component that renderers link, installed alone.
check_screen() {
    alone=$work/alone
    rm -rf "$alone"
    "$cmake" --install "$build" --prefix "$alone" --component screen >/dev/null
    ! grep -l '<cranny/\(scene\|trace\|frame\|bake\|cranny\).h>' "$alone"/include/cranny/*.h ||
        die "a header of the component includes one that is not"
    nm -D --defined-only "$alone/$libdir/libcranny-screen.so" | awk '{print $3}' | sed 's/@.*//' |
        sort >"$work/exported-screen"
    ! grep -v '^cranny_' "$work/exported-screen" || die "libcranny-screen.so exports more than cranny_"
    cat "$alone"/include/cranny/*.h | grep -v '^#' | tr '\n' ' ' | grep -o 'CRANNY_API [^;]*;' |
        grep -o 'cranny_[a-z0-9_]* *(' | tr -d ' (' | sort -u >"$work/declared-screen"
    [ "$(wc -l <"$work/declared-screen")" -ge 20 ] || die "too few declarations found"
    missing=$(comm -23 "$work/declared-screen" "$work/exported-screen")
    [ -z "$missing" ] || die "declared but not in libcranny-screen.so: $missing"
    check_light "$alone/$libdir/libcranny-screen.so"
    "$cmake" -S "$source/tests/install/screen" -B "$work/screen" -DCMAKE_PREFIX_PATH="$alone" \
        -DCMAKE_C_COMPILER="$cc" -DCMAKE_BUILD_TYPE=Release >"$work/screen.log" 2>&1 ||
        { cat "$work/screen.log" >&2; die "find_package with COMPONENTS screen failed"; }
    "$cmake" --build "$work/screen" >"$work/screen.log" 2>&1 ||
        { cat "$work/screen.log" >&2; die "the component does not link"; }
    for kind in cranny-screen cranny-screen-static; do
        "$work/screen/user-$kind"
        check_light "$work/screen/user-$kind"
    done
    PKG_CONFIG_PATH=$alone/$libdir/pkgconfig
    export PKG_CONFIG_PATH
    "$cc" -std=c17 "$source/tests/install/screen.c" $(pkg-config --cflags --libs cranny-screen) \
        -o "$work/pc-screen"
    LD_LIBRARY_PATH=$alone/$libdir "$work/pc-screen"
    mkdir -p "$work/static-screen"
    cp "$alone/$libdir/libcranny-screen.a" "$work/static-screen"
    "$cc" -std=c17 "$source/tests/install/screen.c" -L"$work/static-screen" \
        $(pkg-config --static --cflags --libs cranny-screen) -o "$work/pc-screen-static"
    "$work/pc-screen-static"
    check_light "$work/pc-screen-static"
}

case $step in
prefix) make_prefix ;;
headers) check_headers ;;
symbols) check_symbols ;;
package) check_package ;;
pkgconfig) check_pkgconfig ;;
screen) check_screen ;;
*) die "unknown step $step" ;;
esac
