/* Names and refusals that the demo's parts share. */
#ifndef DEMO_FILES_H
#define DEMO_FILES_H

#include <cranny/cranny.h>

/* FOLDER/name; malloced; NULL: out of memory. */
char *path_in(const char *folder, const char *name);

enum cranny_status no_memory(struct cranny_error *why);

#endif
