#include "scene/document_parts.h"

#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <strings.h>
#include <sys/stat.h>

bool uri_is_data(const char *uri)
{
    return strncasecmp(uri, "data:", 5) == 0;
}

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    c = (char)(c | 0x20);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* One byte of percent-encoded text; a '%' that begins no escape stands for itself. */
static uint8_t next_byte(const char **text)
{
    const char *t = *text;
    int high = t[0] == '%' ? hex_digit(t[1]) : -1, low = high >= 0 ? hex_digit(t[2]) : -1;
    *text += low >= 0 ? 3 : 1;
    return low >= 0 ? (uint8_t)(high << 4 | low) : (uint8_t)t[0];
}

static int base64_value(uint8_t c)
{
    if (c >= 'A' && c <= 'Z')
        return c - 'A';
    if (c >= 'a' && c <= 'z')
        return c - 'a' + 26;
    if (c >= '0' && c <= '9')
        return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/* Decode into `out` (room for 3/4 of the text and 2); false on anything that is not base64. */
static bool base64_decode(const char *text, uint8_t *out, size_t *out_size)
{
    size_t digits = 0, padding = 0, used = 0;
    uint32_t bits = 0;
    while (*text) {
        const uint8_t c = next_byte(&text);
        if (c == ' ' || (c >= '\t' && c <= '\r'))
            continue;
        const int value = base64_value(c);
        padding += c == '=';
        if (c == '=' ? padding > 2 : value < 0 || padding)
            return false;
        if (c == '=')
            continue;
        bits = bits << 6 | (uint32_t)value;
        if (++digits % 4 != 1)
            out[used++] = (uint8_t)(bits >> (digits % 4 == 2 ? 4 : digits % 4 == 3 ? 2 : 0));
    }
    *out_size = used;
    return digits % 4 != 1 && (!padding || (digits + padding) % 4 == 0);
}

static bool ends_with_base64(const char *start, const char *comma)
{
    return comma - start >= 7 && strncasecmp(comma - 7, ";base64", 7) == 0;
}

enum cranny_status uri_decode_data(const struct document *document, const char *uri,
                                   const char *where, uint8_t **data, size_t *size,
                                   struct cranny_error *why)
{
    *data = NULL;
    *size = 0;
    const char *comma = strchr(uri, ',');
    if (!comma)
        return fail(why, CRANNY_INPUT, "%s: %s: a data URI without a comma", document->path, where);
    const char *text = comma + 1;
    uint8_t *bytes = malloc(strlen(text) + 4);
    if (!bytes)
        return fail_memory(why, where);
    size_t used = 0;
    bool good = true;
    if (ends_with_base64(uri, comma))
        good = base64_decode(text, bytes, &used);
    else
        while (*text)
            bytes[used++] = next_byte(&text);
    if (!good) {
        free(bytes);
        return fail(why, CRANNY_INPUT, "%s: %s: the data URI's base64 is broken", document->path,
                    where);
    }
    bytes[used] = 0;
    *data = bytes;
    *size = used;
    return CRANNY_OK;
}

/* Feeds bytes to base64 across the borders of parts. */
struct encoder {
    char *out;
    uint32_t bits;
    int held;
};

static void encode_bytes(struct encoder *encoder, const uint8_t *data, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i++) {
        encoder->bits = encoder->bits << 8 | data[i];
        if (++encoder->held < 3)
            continue;
        for (int shift = 18; shift >= 0; shift -= 6)
            *encoder->out++ = digits[encoder->bits >> shift & 63];
        encoder->held = 0;
        encoder->bits = 0;
    }
}

char *uri_encode_data(const char *type, const struct file_part *parts, size_t part_count)
{
    size_t size = 0;
    for (size_t i = 0; i < part_count; i++) {
        if (parts[i].size > SIZE_MAX / 4 - size)
            return NULL;
        size += parts[i].size;
    }
    const size_t head = strlen(type) + sizeof "data:;base64,";
    char *text = malloc(head + (size + 2) / 3 * 4);
    if (!text)
        return NULL;
    struct encoder encoder = {.out = text + sprintf(text, "data:%s;base64,", type)};
    for (size_t i = 0; i < part_count; i++)
        encode_bytes(&encoder, parts[i].data, parts[i].size);
    const int missing = encoder.held ? 3 - encoder.held : 0;
    if (missing) {
        static const uint8_t zeros[2];
        encode_bytes(&encoder, zeros, (size_t)missing);
        memset(encoder.out - missing, '=', (size_t)missing);
    }
    *encoder.out = 0;
    return text;
}

char *path_folder(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? strndup(path, (size_t)(slash - path) + 1) : strdup("");
}

static bool has_scheme(const char *uri)
{
    if (!isalpha((unsigned char)*uri))
        return false;
    while (isalnum((unsigned char)*uri) || *uri == '+' || *uri == '-' || *uri == '.')
        uri++;
    return *uri == ':';
}

/* Whether a relative path climbs above where it starts. */
static bool climbs_out(const char *path)
{
    int depth = 0;
    while (*path) {
        const size_t length = strcspn(path, "/\\");
        if (length == 2 && path[0] == '.' && path[1] == '.')
            depth--;
        else if (length && !(length == 1 && path[0] == '.'))
            depth++;
        if (depth < 0)
            return true;
        path += length + (path[length] != 0);
    }
    return false;
}

static char *decode_path(const char *uri, const char *where, const struct document *document,
                         struct cranny_error *why)
{
    char *path = malloc(strlen(uri) + 1), *out = path;
    if (!path) {
        fail_memory(why, where);
        return NULL;
    }
    while (*uri) {
        *out = (char)next_byte(&uri);
        if (!*out++) {
            free(path);
            fail(why, CRANNY_INPUT, "%s: %s: the URI holds a zero byte", document->path, where);
            return NULL;
        }
    }
    *out = 0;
    return path;
}

static char *join_path(const char *folder, const char *relative)
{
    size_t length = strlen(folder) + strlen(relative) + 1;
    char *path = malloc(length);
    if (path)
        snprintf(path, length, "%s%s", folder, relative);
    return path;
}

bool path_within(const char *path, const char *folder)
{
    char *real_folder = realpath(*folder ? folder : ".", NULL), *real_path = realpath(path, NULL);
    const size_t length = real_folder ? strlen(real_folder) : 0;
    const bool within = real_folder && real_path && strncmp(real_path, real_folder, length) == 0 &&
                        (real_path[length] == '/' || real_folder[length - 1] == '/');
    free(real_folder);
    free(real_path);
    return within;
}

/* Existence, kind and place of the file that `relative` names. *missing: it is not there. */
static enum cranny_status locate(const struct document *document, const char *relative,
                                 const char *where, char **path, bool *missing,
                                 struct cranny_error *why)
{
    struct stat info;
    char *folder = relative[0] == '/' ? strdup("") : path_folder(document->path);
    *path = folder ? join_path(folder, relative) : NULL;
    enum cranny_status status = CRANNY_OK;
    *missing = false;
    if (!*path) {
        status = fail_memory(why, where);
    } else if (stat(*path, &info) != 0) {
        *missing = true;
        status = fail(why, CRANNY_INPUT, "%s: %s: %s cannot be opened: %s", document->path, where,
                      *path, strerror(errno));
    } else if (!S_ISREG(info.st_mode)) {
        status = fail(why, CRANNY_INPUT, "%s: %s: %s is not a file", document->path, where, *path);
    } else if (!document->allow_outside && !path_within(*path, folder)) {
        status = fail(why, CRANNY_INPUT,
                      "%s: %s: '%s' leaves the scene's folder; pass --allow-outside to read it",
                      document->path, where, relative);
    }
    free(folder);
    if (status != CRANNY_OK) {
        free(*path);
        *path = NULL;
    }
    return status;
}

static enum cranny_status check_uri(const struct document *document, const char *decoded,
                                    const char *where, struct cranny_error *why)
{
    const char *fault = NULL;
    if (!*decoded)
        return fail(why, CRANNY_INPUT, "%s: %s: an empty URI", document->path, where);
    if (has_scheme(decoded))
        return fail(why, CRANNY_INPUT,
                    "%s: %s: '%.60s' carries a scheme; only relative files and data URIs are read",
                    document->path, where, decoded);
    if (decoded[0] == '/' || decoded[0] == '\\')
        fault = "is an absolute path";
    else if (climbs_out(decoded))
        fault = "leaves the scene's folder";
    if (fault && !document->allow_outside)
        return fail(why, CRANNY_INPUT, "%s: %s: '%.200s' %s; pass --allow-outside to read it",
                    document->path, where, decoded, fault);
    return CRANNY_OK;
}

/* Some exporters write Windows separators, or file names that were never percent-encoded. */
static enum cranny_status locate_spellings(const struct document *document, const char *uri,
                                           const char *where, char *decoded, char **path,
                                           struct cranny_error *why)
{
    bool missing, missing_still;
    enum cranny_status status = locate(document, decoded, where, path, &missing, why);
    if (missing && strcmp(uri, decoded) != 0 &&
        check_uri(document, uri, where, NULL) == CRANNY_OK &&
        locate(document, uri, where, path, &missing_still, NULL) == CRANNY_OK) {
        strcpy(decoded, uri);
        return CRANNY_OK;
    }
    if (!missing || !strchr(decoded, '\\'))
        return status;
    for (char *c = decoded; *c; c++)
        *c = *c == '\\' ? '/' : *c;
    return locate(document, decoded, where, path, &missing_still, why);
}

enum cranny_status uri_resolve(const struct document *document, const char *uri, const char *where,
                               char **path, char **relative, struct cranny_error *why)
{
    *path = NULL;
    if (relative)
        *relative = NULL;
    if (document->in_memory)
        return fail(why, CRANNY_INPUT,
                    "%s: %s: names a file, but the scene is in memory; use data URIs or a .glb",
                    document->path, where);
    /* A decoded path is never longer than its URI, so the raw spelling fits in its place. */
    char *decoded = malloc(strlen(uri) + 1), *plain = decode_path(uri, where, document, why);
    if (!decoded || !plain) {
        free(decoded);
        free(plain);
        return decoded ? why ? why->status : CRANNY_INPUT : fail_memory(why, where);
    }
    strcpy(decoded, plain);
    free(plain);
    enum cranny_status status = check_uri(document, decoded, where, why);
    if (status == CRANNY_OK)
        status = locate_spellings(document, uri, where, decoded, path, why);
    if (status == CRANNY_OK && relative)
        *relative = decoded;
    else
        free(decoded);
    return status;
}
