/* Rows of a parameter table, a line each. The including file says whose fields they are:
 * #define ROW_STRUCT struct cranny_bake_params */
#ifndef BASE_ROWS_H
#define BASE_ROWS_H

#include "base/base.h"

#define ROW_STEP(FIELD, TYPE, UNIT, LOW, HIGH, DEFAULT, CHOICES, STEP, HELP)                       \
    {                                                                                              \
        .name = #FIELD, .offset = offsetof(ROW_STRUCT, FIELD), .type = TYPE, .unit = UNIT,         \
        .minimum = LOW, .maximum = HIGH, .fallback = DEFAULT, .choices = CHOICES, .help = HELP,    \
        .step = STEP                                                                               \
    }
#define ROW(FIELD, TYPE, UNIT, LOW, HIGH, DEFAULT, CHOICES, HELP)                                  \
    ROW_STEP(FIELD, TYPE, UNIT, LOW, HIGH, DEFAULT, CHOICES, 0, HELP)
#define REAL(FIELD, UNIT, LOW, HIGH, DEFAULT, HELP)                                                \
    ROW(FIELD, CRANNY_PARAM_FLOAT, UNIT, LOW, HIGH, DEFAULT, NULL, HELP)
/* One that cranny_tune fits, with a first step of STEP. */
#define FITTED(FIELD, UNIT, LOW, HIGH, DEFAULT, STEP, HELP)                                        \
    ROW_STEP(FIELD, CRANNY_PARAM_FLOAT, UNIT, LOW, HIGH, DEFAULT, NULL, STEP, HELP)
#define WHOLE(FIELD, UNIT, LOW, HIGH, DEFAULT, HELP)                                               \
    ROW(FIELD, CRANNY_PARAM_INT, UNIT, LOW, HIGH, DEFAULT, NULL, HELP)
#define SWITCH(FIELD, DEFAULT, HELP) ROW(FIELD, CRANNY_PARAM_BOOL, "", 0, 1, DEFAULT, NULL, HELP)
/* NAMES: an array of texts that ends with NULL. */
#define CHOICE(FIELD, NAMES, DEFAULT, HELP)                                                        \
    ROW(FIELD, CRANNY_PARAM_ENUM, "", 0, COUNT_OF(NAMES) - 2, DEFAULT, NAMES, HELP)

#endif
