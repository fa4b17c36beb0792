#include "base/image_channels.h"

#include <string.h>
#include <strings.h>

struct names {
    const char *const *list;
    int count;
};

/* A layer is the part of a name before its last dot. */
struct layer {
    const char *text;
    size_t length;
};

static const char *const value_names[] = {"Y", "V", "R"};
static const char *const axis_names[] = {"X", "Y", "Z"};
static const char *const color_names[] = {"R", "G", "B"};

static struct layer layer_of(const char *name)
{
    const char *dot = strrchr(name, '.');
    return (struct layer){name, dot ? (size_t)(dot - name) : 0};
}

/* Whether the innermost layer is called `word`. */
static bool layer_ends_in(struct layer layer, const char *word)
{
    size_t length = strlen(word);
    if (layer.length < length || strncasecmp(layer.text + layer.length - length, word, length) != 0)
        return false;
    return layer.length == length || layer.text[layer.length - length - 1] == '.';
}

static int find(struct names names, struct layer layer, const char *last)
{
    for (int i = 0; i < names.count; i++) {
        struct layer own = layer_of(names.list[i]);
        const char *end = own.text + own.length + (own.length || *own.text == '.');
        if (own.length == layer.length && strncasecmp(own.text, layer.text, own.length) == 0 &&
            strcasecmp(end, last) == 0)
            return i;
    }
    return -1;
}

static struct channel_choice one(int index)
{
    return (struct channel_choice){.count = index >= 0, .index = {index}};
}

static struct channel_choice find_any(struct names names, struct layer layer,
                                      const char *const lasts[], int last_count)
{
    int index = -1;
    for (int i = 0; i < last_count && index < 0; i++)
        index = find(names, layer, lasts[i]);
    return one(index);
}

static struct channel_choice find_three(struct names names, struct layer layer,
                                        const char *const lasts[3])
{
    struct channel_choice choice = {.count = 3};
    for (int i = 0; i < 3; i++) {
        choice.index[i] = find(names, layer, lasts[i]);
        if (choice.index[i] < 0)
            return (struct channel_choice){0};
    }
    return choice;
}

/* The layer that all channels share; length 0 when they do not. */
static struct layer only_layer(struct names names)
{
    const struct layer none = {"", 0};
    struct layer first = names.count ? layer_of(names.list[0]) : none;
    for (int i = 1; i < names.count; i++) {
        struct layer own = layer_of(names.list[i]);
        if (own.length != first.length || strncasecmp(own.text, first.text, own.length) != 0)
            return none;
    }
    return first;
}

/* Beside an X, Y is a coordinate. */
static struct channel_choice find_value(struct names names, struct layer layer)
{
    if (find(names, layer, "X") >= 0)
        return (struct channel_choice){0};
    return find_any(names, layer, value_names, 3);
}

static struct channel_choice choose_value(struct names names)
{
    const struct layer none = {"", 0};
    struct channel_choice choice = find_value(names, none);
    if (!choice.count && names.count == 1)
        choice = one(0);
    return choice.count ? choice : find_value(names, only_layer(names));
}

static struct channel_choice choose_depth(struct names names)
{
    static const char *const lasts[] = {"Z", "V", "Y", "R", "depth"};
    static const char *const layers[] = {"depth", "z"};
    const struct layer none = {"", 0};
    int plain = find(names, none, "Z");
    if (plain < 0)
        plain = find(names, none, "depth");
    struct channel_choice choice = one(plain);
    for (int l = 0; l < 2; l++)
        for (int i = 0; i < names.count && !choice.count; i++)
            if (layer_ends_in(layer_of(names.list[i]), layers[l]))
                choice = find_any(names, layer_of(names.list[i]), lasts, 5);
    return choice.count ? choice : choose_value(names);
}

static struct channel_choice find_vector(struct names names, struct layer layer)
{
    struct channel_choice choice = find_three(names, layer, axis_names);
    return choice.count ? choice : find_three(names, layer, color_names);
}

static struct channel_choice choose_normal(struct names names)
{
    static const char *const layers[] = {"N", "normal", "normals"};
    static const char *const joined[] = {"NX", "NY", "NZ"};
    const struct layer none = {"", 0};
    struct channel_choice choice = {0};
    for (int l = 0; l < 3; l++)
        for (int i = 0; i < names.count && !choice.count; i++)
            if (layer_ends_in(layer_of(names.list[i]), layers[l]))
                choice = find_vector(names, layer_of(names.list[i]));
    if (!choice.count)
        choice = find_three(names, none, joined);
    if (!choice.count)
        choice = find_vector(names, none);
    return choice.count ? choice : find_vector(names, only_layer(names));
}

static struct channel_choice choose_color(struct names names)
{
    const struct layer none = {"", 0};
    struct channel_choice choice = find_three(names, none, color_names);
    if (!choice.count)
        choice = find_three(names, only_layer(names), color_names);
    return choice.count ? choice : choose_value(names);
}

struct channel_choice channels_choose(enum cranny_image_kind kind, const char *const *names,
                                      int name_count)
{
    const struct names all = {names, name_count};
    switch (kind) {
    case CRANNY_IMAGE_VALUE:
        return choose_value(all);
    case CRANNY_IMAGE_DEPTH:
        return choose_depth(all);
    case CRANNY_IMAGE_NORMAL:
        return choose_normal(all);
    case CRANNY_IMAGE_COLOR:
        return choose_color(all);
    }
    return (struct channel_choice){0};
}

const char *channels_wanted(enum cranny_image_kind kind)
{
    switch (kind) {
    case CRANNY_IMAGE_VALUE:
        return "Y, V or R";
    case CRANNY_IMAGE_DEPTH:
        return "Z, depth.Z, Y, V or R";
    case CRANNY_IMAGE_NORMAL:
        return "N.X N.Y N.Z, normal.X normal.Y normal.Z, X Y Z or R G B";
    case CRANNY_IMAGE_COLOR:
        return "R G B, Y or V";
    }
    return "";
}
