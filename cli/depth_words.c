/* The library's doctor speaks of its own constants; here they become options. */
#include "depth.h"

#include <string.h>

struct phrase {
    const char *code; /* of the findings it occurs in; a prefix */
    const char *library, *command;
};

static const struct phrase phrases[] = {
    {"depth-", "linearise it with kind CRANNY_DEPTH_DEVICE", "pass --depth-kind device"},
    {"depth-", "linearise it with kind CRANNY_DEPTH_LOGARITHMIC", "pass --depth-kind logarithmic"},
    {"depth-", "linearise it with kind CRANNY_DEPTH_NORMALIZED", "pass --depth-kind normalized"},
    {"depth-", "linearise with kind CRANNY_DEPTH_NORMALIZED", "pass --depth-kind normalized"},
    {"depth-", "linearise it with kind CRANNY_DEPTH_VIEW_Z", "pass --depth-kind view-z"},
    {"depth-", ", reversed and ", ", --reversed and "},
    {"depth-", ", reversed, and ", ", --reversed, and "},
    {"depth-", ", reversed, gl_range", ", --reversed, --depth-range gl"},
    {"depth-", ", gl_range", ", --depth-range gl"},
    {"depth-", "the camera's near and far planes", "the camera's --near and --far"},
    {"depth-", "the near and far planes", "the camera's --near and --far"},
    {"depth-", "the renderer's constant and far plane", "the renderer's --log-c and --far"},
    {"depth-scale", "multiply by 0.001, or by what", "pass --depth-scale 0.001, or what"},
    {"depth-scale", "multiply it by 1000, or by the far plane",
     "pass --depth-scale 1000, or the far plane"},
    {"depth-scale", "multiply it by ", "pass --depth-scale "},
    {"depth-sky", "store +INFINITY there", "pass that as --far"},
    {"projection-kind", "pass CRANNY_PERSPECTIVE, or linearise the depth first",
     "pass --fov, or the --depth-kind"},
    {"projection-kind", "pass CRANNY_ORTHOGRAPHIC, or linearise the depth first",
     "pass --ortho, or the --depth-kind"},
    {"projection-assumed", "no projection was given", "neither --fov nor --ortho was given"},
    {"normal-range", "store 2 c - 1", "pass --normal-range unsigned"},
    {"normal-sign", "negate them", "pass --normal-flip xyz"},
    {"normal-length", ", but if they were compressed another way pass normal_format", ""},
    {"normal-", "pass NULL to have them reconstructed",
     "leave --normal out to have them reconstructed"},
    {"normal-", "pass NULL if there are none", "leave --normal out if there are none"},
};

static void replace(char *text, size_t size, const char *from, const char *to)
{
    char *at = strstr(text, from);
    if (!at)
        return;
    char rest[CRANNY_ERROR_TEXT_SIZE];
    snprintf(rest, sizeof rest, "%s", at + strlen(from));
    snprintf(at, size - (size_t)(at - text), "%s%s", to, rest);
}

/* "pass (x, -y, -z)" is "pass --normal-flip yz" where the order stays. */
static void replace_recipe(char *text, size_t size)
{
    for (int flips = 1; flips < 8; flips++) {
        char recipe[32] = "pass (", option[32] = "pass --normal-flip ";
        for (int axis = 0; axis < 3; axis++) {
            const bool flip = flips >> axis & 1;
            const char letter = "xyz"[axis];
            const size_t used = strlen(recipe), length = strlen(option);
            snprintf(recipe + used, sizeof recipe - used, "%s%s%c%s", axis ? ", " : "",
                     flip ? "-" : "", letter, axis == 2 ? ")" : "");
            snprintf(option + length, sizeof option - length, "%.*s", flip, &letter);
        }
        replace(text, size, recipe, option);
    }
}

void depth_words(const char *code, const char *text, char *out, size_t size)
{
    snprintf(out, size, "%s", text);
    for (size_t i = 0; i < sizeof phrases / sizeof *phrases; i++)
        if (strncmp(code, phrases[i].code, strlen(phrases[i].code)) == 0)
            replace(out, size, phrases[i].library, phrases[i].command);
    if (strcmp(code, "normal-axis") == 0)
        replace_recipe(out, size);
}
