#include "compare/report_parts.h"

#include <inttypes.h>

/* The bytes of a well-formed UTF-8 character that may stand in HTML at `s`; 0: there is none. */
static int character_bytes(const unsigned char *s)
{
    static const unsigned least[5] = {0, 0, 0x80, 0x800, 0x10000};
    const int count = s[0] < 0x80 ? 1 : s[0] < 0xc0 ? 0 : s[0] < 0xe0 ? 2 : s[0] < 0xf0 ? 3 : 4;
    if (count == 1)
        return s[0] >= 0x20 && s[0] != 0x7f;
    unsigned code = count ? s[0] & (0xffu >> (count + 1)) : 0;
    for (int i = 1; i < count; i++) {
        if ((s[i] & 0xc0) != 0x80)
            return 0;
        code = code << 6 | (s[i] & 0x3fu);
    }
    const bool good = code >= least[count] && code < 0x110000 && (code < 0xd800 || code > 0xdfff);
    return count && good && code >= 0xa0 ? count : 0;
}

void report_text(FILE *out, const char *text)
{
    for (const char *s = text ? text : ""; *s;) {
        const int bytes = character_bytes((const unsigned char *)s);
        if (*s == '<')
            fputs("&lt;", out);
        else if (*s == '>')
            fputs("&gt;", out);
        else if (*s == '&')
            fputs("&amp;", out);
        else if (*s == '"')
            fputs("&quot;", out);
        else if (*s == '\n' || *s == '\t')
            fputc(*s, out);
        else if (bytes)
            fwrite(s, 1, (size_t)bytes, out);
        else
            fputs("\xef\xbf\xbd", out);
        s += bytes ? bytes : 1;
    }
}

void report_breaking(FILE *out, const char *text)
{
    char one[2] = {0};
    for (const char *s = text ? text : ""; *s;) {
        const size_t run = strcspn(s, ",:_-/");
        char *part = strndup(s, run);
        report_text(out, part);
        free(part);
        s += run;
        if (!*s)
            break;
        one[0] = *s++;
        report_text(out, one);
        fputs("<wbr>", out);
    }
}

void report_trial_name(FILE *out, const struct cranny_report_trial *trial)
{
    report_text(out, trial->method);
    fputc(' ', out);
    report_text(out, trial->preset);
    if (strcmp(trial->device, "cpu") != 0) {
        fputs(", ", out);
        report_text(out, trial->device);
    }
}

void report_milliseconds(FILE *out, double milliseconds)
{
    if (milliseconds >= 1000)
        report_count(out, (uint64_t)(milliseconds + 0.5));
    else
        fprintf(out, "%.*f", milliseconds < 9.995 ? 2 : milliseconds < 99.95 ? 1 : 0, milliseconds);
}

void report_count(FILE *out, uint64_t count)
{
    char digits[24];
    const int length = snprintf(digits, sizeof digits, "%" PRIu64, count);
    for (int i = 0; i < length; i++) {
        if (i && (length - i) % 3 == 0)
            fputc(',', out);
        fputc(digits[i], out);
    }
}

static void base64(FILE *out, const uint8_t *bytes, size_t size)
{
    static const char letters[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const unsigned second = i + 1 < size ? bytes[i + 1] : 0;
        const unsigned third = i + 2 < size ? bytes[i + 2] : 0;
        const unsigned bits = (unsigned)bytes[i] << 16 | second << 8 | third;
        const char four[4] = {letters[bits >> 18], letters[bits >> 12 & 63],
                              i + 1 < size ? letters[bits >> 6 & 63] : '=',
                              i + 2 < size ? letters[bits & 63] : '='};
        fwrite(four, 1, 4, out);
    }
}

enum cranny_status report_image(FILE *out, const char *path, struct cranny_error *why)
{
    uint8_t *bytes;
    size_t size;
    const enum cranny_status status = file_read(path, UINT64_C(1) << 31, &bytes, &size, why);
    if (status != CRANNY_OK)
        return status;
    fputs("data:image/png;base64,", out);
    base64(out, bytes, size);
    free(bytes);
    return CRANNY_OK;
}
