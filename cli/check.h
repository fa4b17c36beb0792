/* What `check` finds, whatever it looks at. */
#ifndef CLI_CHECK_H
#define CLI_CHECK_H

#include "commands.h"
#include "depth.h"

struct findings {
    struct ui *ui;
    const char *path;
    json_t *list;
    int counts[3]; /* by severity */
};

/* Print a finding, or keep it for the JSON result. A cranny_scene_check callback. */
void findings_add(void *findings, enum cranny_severity severity, const char *code,
                  const char *text);

/* The end of the output; takes the reference to `advice`, NULL for none. The exit status. */
int findings_print(struct findings *findings, json_t *advice);

enum cranny_status check_depth(const struct depth_options *options, const struct view_options *view,
                               struct findings *findings, json_t **advice,
                               struct cranny_error *why);

#endif
