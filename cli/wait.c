/* Linked into every program: lets idle OpenMP threads sleep instead of spin.
 *
 * libgomp reads its wait policy once, when it is loaded. Its default spins at each barrier, and on
 * a machine where something else runs too that makes a solve ten times slower (docs/decisions.md).
 * Functions in .preinit_array run before the constructors of shared libraries, so this is in time;
 * what the user has set stays. */
#include <stdlib.h>

#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
typedef void preinit_fn(int argc, char **argv, char **environment);

static void wait_passively(int argc, char **argv, char **environment)
{
    (void)argc;
    (void)argv;
    (void)environment;
    setenv("OMP_WAIT_POLICY", "passive", 0);
}

__attribute__((section(".preinit_array"), used)) static preinit_fn *const preinit = wait_passively;
#endif
