/* Which of a layered file's channels are meant, by their names. */
#ifndef BASE_IMAGE_CHANNELS_H
#define BASE_IMAGE_CHANNELS_H

#include <cranny/image.h>

/* Indices into the names, in the order of the pixels; `count` 1 or 3, 0: not there. */
struct channel_choice {
    int count, index[3];
};

/* Names are "X" or "LAYER.X", layers nest with dots; upper and lower case are the same. */
struct channel_choice channels_choose(enum cranny_image_kind kind, const char *const *names,
                                      int name_count);

/* What channels_choose looks for, for messages. */
const char *channels_wanted(enum cranny_image_kind kind);

#endif
