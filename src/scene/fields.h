/* JSON members with their place in the document, so that every complaint can name its pointer. */
#ifndef SCENE_FIELDS_H
#define SCENE_FIELDS_H

#include "scene/document.h"

/* A step of a JSON pointer; printed only when something is wrong. */
struct place {
    const struct place *up;
    const char *name;
    size_t index; /* NO_INDEX: a member without one */
};

#define NO_INDEX SIZE_MAX
#define PLACE(up, name, index) (&(const struct place){up, name, index})

/* fail() with "FILE: /meshes/3/primitives/0: " in front of the text. */
enum cranny_status fail_at(const struct document *document, const struct place *place,
                           struct cranny_error *why, enum cranny_status status, const char *format,
                           ...) __attribute__((format(printf, 5, 6)));
/* The same as a warning to the document's log. */
void warn_at(const struct document *document, const struct place *place, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Each reads the member `name` of `object`. Absent members give the fallback; members of another
 * type are CRANNY_INPUT. */

/* An object or array; NULL when absent. */
enum cranny_status field_object(const struct document *document, const struct place *place,
                                const json_t *object, const char *name, json_t **value,
                                struct cranny_error *why);
enum cranny_status field_array(const struct document *document, const struct place *place,
                               const json_t *object, const char *name, json_t **value,
                               struct cranny_error *why);
/* A whole number, not negative. */
enum cranny_status field_count(const struct document *document, const struct place *place,
                               const json_t *object, const char *name, uint64_t fallback,
                               uint64_t *value, struct cranny_error *why);
/* An index below `limit`; -1 when absent. */
enum cranny_status field_index(const struct document *document, const struct place *place,
                               const json_t *object, const char *name, size_t limit, int *value,
                               struct cranny_error *why);
/* A value that is an index below `limit`. `name` is for the message. */
enum cranny_status value_index(const struct document *document, const struct place *place,
                               const json_t *value, const char *name, size_t limit, size_t *index,
                               struct cranny_error *why);
/* `count` numbers; left alone when absent. */
enum cranny_status field_numbers(const struct document *document, const struct place *place,
                                 const json_t *object, const char *name, size_t count,
                                 double *values, bool *present, struct cranny_error *why);

/* A number, or the fallback for anything else: where a wrong value harms nothing. */
double loose_number(const json_t *object, const char *name, double fallback);
/* The name of a thing, "" when it has none. */
const char *loose_name(const json_t *object);
/* The object under `extensions`, NULL when there is none. */
json_t *extension_of(const json_t *object, const char *name);

/* A top-level array by name; NULL when absent. Its length by document_count. */
json_t *document_array(const struct document *document, const char *name);
size_t document_count(const struct document *document, const char *name);
/* Item `index` of a top-level array; CRANNY_INPUT when it does not exist or is no object. */
enum cranny_status document_item(const struct document *document, const char *array, size_t index,
                                 json_t **item, struct cranny_error *why);

#endif
