#include "scene/fields.h"

#include <stdarg.h>

static size_t place_text(const struct place *place, char *text, size_t size)
{
    if (!place)
        return 0;
    size_t used = place_text(place->up, text, size);
    int more = place->index == NO_INDEX
                   ? snprintf(text + used, size - used, "/%s", place->name)
                   : snprintf(text + used, size - used, "/%s/%zu", place->name, place->index);
    return more < 0 || used + (size_t)more >= size ? used : used + (size_t)more;
}

enum cranny_status fail_at(const struct document *document, const struct place *place,
                           struct cranny_error *why, enum cranny_status status, const char *format,
                           ...)
{
    char pointer[256] = "", text[512];
    place_text(place, pointer, sizeof pointer);
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return fail(why, status, "%s: %s: %s", document->path, pointer, text);
}

void warn_at(const struct document *document, const struct place *place, const char *format, ...)
{
    char pointer[256] = "", text[512];
    place_text(place, pointer, sizeof pointer);
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    hook_warn(document->hooks, "%s: %s: %s", document->path, pointer, text);
}

enum cranny_status field_object(const struct document *document, const struct place *place,
                                const json_t *object, const char *name, json_t **value,
                                struct cranny_error *why)
{
    *value = json_object_get(object, name);
    if (*value && !json_is_object(*value)) {
        *value = NULL;
        return fail_at(document, PLACE(place, name, NO_INDEX), why, CRANNY_INPUT,
                       "must be an object");
    }
    return CRANNY_OK;
}

enum cranny_status field_array(const struct document *document, const struct place *place,
                               const json_t *object, const char *name, json_t **value,
                               struct cranny_error *why)
{
    *value = json_object_get(object, name);
    if (*value && !json_is_array(*value)) {
        *value = NULL;
        return fail_at(document, PLACE(place, name, NO_INDEX), why, CRANNY_INPUT,
                       "must be an array");
    }
    return CRANNY_OK;
}

/* Exporters in languages without integers write 3.0 where 3 is meant. */
static bool whole_number(const json_t *value, uint64_t *number)
{
    if (json_is_integer(value) && json_integer_value(value) >= 0) {
        *number = (uint64_t)json_integer_value(value);
        return true;
    }
    double real = json_is_real(value) ? json_real_value(value) : -1;
    if (!(real >= 0 && real <= 9007199254740992.0) || real != floor(real))
        return false;
    *number = (uint64_t)real;
    return true;
}

enum cranny_status field_count(const struct document *document, const struct place *place,
                               const json_t *object, const char *name, uint64_t fallback,
                               uint64_t *value, struct cranny_error *why)
{
    const json_t *member = json_object_get(object, name);
    *value = fallback;
    if (member && !whole_number(member, value))
        return fail_at(document, PLACE(place, name, NO_INDEX), why, CRANNY_INPUT,
                       "must be a whole number, not negative");
    return CRANNY_OK;
}

enum cranny_status value_index(const struct document *document, const struct place *place,
                               const json_t *value, const char *name, size_t limit, size_t *index,
                               struct cranny_error *why)
{
    uint64_t number;
    if (!whole_number(value, &number))
        return fail_at(document, place, why, CRANNY_INPUT, "%s must be an index", name);
    if (number >= limit)
        return fail_at(document, place, why, CRANNY_INPUT, "%s %llu does not exist; there are %zu",
                       name, (unsigned long long)number, limit);
    *index = (size_t)number;
    return CRANNY_OK;
}

enum cranny_status field_index(const struct document *document, const struct place *place,
                               const json_t *object, const char *name, size_t limit, int *value,
                               struct cranny_error *why)
{
    const json_t *member = json_object_get(object, name);
    size_t index = 0;
    *value = -1;
    if (!member)
        return CRANNY_OK;
    if (limit > INT32_MAX)
        limit = INT32_MAX;
    enum cranny_status status =
        value_index(document, PLACE(place, name, NO_INDEX), member, name, limit, &index, why);
    if (status == CRANNY_OK)
        *value = (int)index;
    return status;
}

enum cranny_status field_numbers(const struct document *document, const struct place *place,
                                 const json_t *object, const char *name, size_t count,
                                 double *values, bool *present, struct cranny_error *why)
{
    const json_t *array = json_object_get(object, name);
    if (present)
        *present = array != NULL;
    if (!array)
        return CRANNY_OK;
    if (json_array_size(array) != count)
        return fail_at(document, PLACE(place, name, NO_INDEX), why, CRANNY_INPUT,
                       "must be an array of %zu numbers", count);
    for (size_t i = 0; i < count; i++) {
        const json_t *number = json_array_get(array, i);
        if (!json_is_number(number))
            return fail_at(document, PLACE(place, name, i), why, CRANNY_INPUT, "must be a number");
        values[i] = json_number_value(number);
    }
    return CRANNY_OK;
}

double loose_number(const json_t *object, const char *name, double fallback)
{
    const json_t *value = json_object_get(object, name);
    return json_is_number(value) ? json_number_value(value) : fallback;
}

const char *loose_name(const json_t *object)
{
    const char *name = json_string_value(json_object_get(object, "name"));
    return name ? name : "";
}

json_t *extension_of(const json_t *object, const char *name)
{
    json_t *extension = json_object_get(json_object_get(object, "extensions"), name);
    return json_is_object(extension) ? extension : NULL;
}

json_t *document_array(const struct document *document, const char *name)
{
    json_t *array = json_object_get(document->root, name);
    return json_is_array(array) ? array : NULL;
}

size_t document_count(const struct document *document, const char *name)
{
    return json_array_size(json_object_get(document->root, name));
}

enum cranny_status document_item(const struct document *document, const char *array, size_t index,
                                 json_t **item, struct cranny_error *why)
{
    const struct place place = {NULL, array, index};
    *item = json_array_get(json_object_get(document->root, array), index);
    if (!*item)
        return fail_at(document, &place, why, CRANNY_INPUT,
                       "does not exist, but is referred to; there are %zu",
                       document_count(document, array));
    if (!json_is_object(*item))
        return fail_at(document, &place, why, CRANNY_INPUT, "must be an object");
    return CRANNY_OK;
}
