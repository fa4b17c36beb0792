/* Portable float maps: "PF" (RGB) or "Pf" (grey), width, height, a number whose sign tells the byte
 * order (below 0: little-endian), one white space, then rows from the bottom up. */
#include "base/image_float.h"

#include <inttypes.h>

struct cursor {
    const uint8_t *data;
    size_t size, at;
};

static bool is_space(uint8_t c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

/* The next word, cut to what fits; "" at the end. */
static void next_word(struct cursor *cursor, char word[32])
{
    size_t length = 0;
    while (cursor->at < cursor->size && is_space(cursor->data[cursor->at]))
        cursor->at++;
    while (cursor->at < cursor->size && !is_space(cursor->data[cursor->at])) {
        if (length < 31)
            word[length++] = (char)cursor->data[cursor->at];
        cursor->at++;
    }
    word[length] = 0;
}

/* -1: not a whole number. */
static int64_t parse_side(const char *word)
{
    int64_t value = 0;
    size_t length = strlen(word);
    if (!length || length > 9 || strspn(word, "0123456789") != length)
        return -1;
    for (; *word; word++)
        value = value * 10 + (*word - '0');
    return value;
}

/* By its characters: strtod would follow the caller's locale. */
static bool parse_scale(const char *word, bool *little)
{
    *little = *word == '-';
    if (*word == '-' || *word == '+')
        word++;
    size_t mantissa = strspn(word, "0123456789.");
    size_t zeros = strspn(word, "0.");
    return zeros < mantissa && word[mantissa + strspn(word + mantissa, "eE+-0123456789")] == 0;
}

static float load_float(const uint8_t *bytes, bool little)
{
    uint32_t bits = 0;
    for (int i = 0; i < 4; i++)
        bits |= (uint32_t)bytes[i] << 8 * (little ? i : 3 - i);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void load_rows(const uint8_t *data, int file_channels, bool little,
                      struct cranny_image *image)
{
    float *to = image->pixels;
    for (int y = image->height - 1; y >= 0; y--) {
        const uint8_t *from =
            data + (size_t)y * (size_t)image->width * (size_t)file_channels * sizeof(float);
        for (int x = 0; x < image->width; x++, from += (size_t)file_channels * sizeof(float))
            for (int c = 0; c < image->channels; c++)
                *to++ = load_float(from + (file_channels == 3 ? (size_t)c * 4 : 0), little);
    }
}

enum cranny_status image_decode_pfm(const struct image_source *source, struct cranny_image *image,
                                    struct cranny_error *why)
{
    struct cursor cursor = {source->data, source->size, 0};
    char magic[32], width_word[32], height_word[32], scale[32];
    bool little;
    next_word(&cursor, magic);
    next_word(&cursor, width_word);
    next_word(&cursor, height_word);
    next_word(&cursor, scale);
    int64_t width = parse_side(width_word), height = parse_side(height_word);
    if ((strcmp(magic, "PF") != 0 && strcmp(magic, "Pf") != 0) || width < 0 || height < 0 ||
        !parse_scale(scale, &little) || cursor.at >= cursor.size)
        return fail(why, CRANNY_INPUT,
                    "%s: broken PFM header at byte %zu: PF or Pf, width, height and a scale other "
                    "than 0 are due",
                    source->name, cursor.at);
    cursor.at++;
    const int file_channels = magic[1] == 'F' ? 3 : 1;
    const uint64_t need = (uint64_t)width * (uint64_t)height * (uint64_t)file_channels * 4;
    const uint64_t have = cursor.size - cursor.at;
    /* A final newline, as text tools leave, is no reason to refuse. */
    const bool newline = have == need + 1 && cursor.data[cursor.size - 1] == '\n';
    if (have != need && !newline)
        return fail(why, CRANNY_INPUT,
                    "%s: broken PFM: %" PRId64 " x %" PRId64 " pixels are %" PRIu64
                    " bytes, but %" PRIu64 " follow the header; write it again",
                    source->name, width, height, need, have);
    enum cranny_status status = image_alloc(
        source, width, height, image_channels_of(source->kind, file_channels), image, why);
    if (status == CRANNY_OK)
        load_rows(cursor.data + cursor.at, file_channels, little, image);
    return status;
}

enum cranny_status image_encode_pfm(const struct image_view *view, const char *name,
                                    struct image_sink *sink, struct cranny_error *why)
{
    char header[64];
    const uint16_t probe = 1;
    const bool little = *(const uint8_t *)&probe == 1;
    const size_t row_bytes = (size_t)view->width * (size_t)view->channels * sizeof(float);
    int length =
        snprintf(header, sizeof header, "%s\n%d %d\n%s\n", view->channels == 3 ? "PF" : "Pf",
                 view->width, view->height, little ? "-1.0" : "1.0");
    bool good = image_sink_put(sink, 0, header, (size_t)length);
    for (int y = view->height - 1; y >= 0 && good; y--)
        good = image_sink_put(sink, sink->size, image_row(view, y), row_bytes);
    return good ? CRANNY_OK : fail_memory(why, name);
}
