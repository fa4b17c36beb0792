/* Fuzzes the readers of float images: whatever the bytes are, reading ends with a status and a
 * message, an image that was read can be walked to its last value, and all is freed.
 *
 * Run:    fuzz/run.sh 60                 (seconds; preset fuzz, a temporary corpus from
 * image/seeds) Replay: build/tests/fuzz_image_replay FILE|FOLDER...     (any compiler, no engine)
 * A crash goes to image/seeds, as small as it gets, and stays there. */
#include "../replay.h"
#include "base/image_float.h"

#define PIXEL_LIMIT ((uint64_t)1 << 20)

static void read_as(const uint8_t *data, size_t size, enum cranny_image_kind kind)
{
    struct cranny_error why = {0};
    struct cranny_image image;
    const struct image_source source = {
        .data = data, .size = size, .name = "fuzz", .kind = kind, .pixel_limit = PIXEL_LIMIT};
    enum cranny_status status = image_decode_float(&source, &image, &why);
    demand((status == CRANNY_OK) == (image.pixels != NULL), "pixels come with CRANNY_OK only");
    if (status == CRANNY_OK) {
        const bool three = kind == CRANNY_IMAGE_NORMAL || kind == CRANNY_IMAGE_COLOR;
        demand(image.channels == (three ? 3 : 1), "the channels are those of the kind");
        demand((uint64_t)image.width * (uint64_t)image.height <= PIXEL_LIMIT, "the limit holds");
        const size_t count = (size_t)image.width * (size_t)image.height * (size_t)image.channels;
        size_t above = 0;
        for (size_t i = 0; i < count; i++)
            above += image.pixels[i] > 0;
        demand(above <= count, "every value can be read");
    } else {
        demand(status == CRANNY_INPUT || status == CRANNY_MEMORY, "bytes are to blame");
        demand(why.status == status && *why.message && !strchr(why.message, '\n'),
               "the message is one line");
    }
    cranny_image_free(&image);
    demand(!image.pixels && !image.width, "freeing clears the image");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    for (int kind = CRANNY_IMAGE_VALUE; kind <= CRANNY_IMAGE_COLOR; kind++)
        read_as(data, size, (enum cranny_image_kind)kind);
    return 0;
}
