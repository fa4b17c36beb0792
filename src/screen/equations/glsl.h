/* The equations' words in GLSL, one pixel an invocation. The including shader binds `view` (the
 * fields of struct canvas), `constants` (those of struct screen_constants), the depth as
 * frame_depth[] and the normals as frame_normal[]. */
#ifndef EQUATIONS_GLSL_H
#define EQUATIONS_GLSL_H

#define FUNCTION
#define RECORD(NAME)
#define float_(X) float(X)
#define int_(X) int(X)
#define ON(field) (constants.field != 0)
#define VIEW_ARG
#define VIEW_PASS
#define VIEW(field) (view.field)
#define CONSTANTS_ARG
#define CONSTANTS_PASS
#define K(field) (constants.field)
#define READ_DEPTH(index) frame_depth[index]
#define READ_NORMAL(index) frame_normal[index].xyz

#define lane_f float
#define lane_i int
#define lane_b bool
#define lane_3 vec3

#define splat(X) (X)
#define vec3_(X, Y, Z) vec3(X, Y, Z)
#define add3(A, B) ((A) + (B))
#define sub3(A, B) ((A) - (B))
#define scale3(A, S) ((A) * (S))
#define dot3(A, B) dot(A, B)
#define min_(A, B) min(A, B)
#define max_(A, B) max(A, B)
#define clamp_(X, LOW, HIGH) clamp(X, LOW, HIGH)
#define saturate_(X) clamp(X, 0.0, 1.0)
#define sqrt_(X) sqrt(X)
#define floor_(X) floor(X)
#define acos_(X) acos(X)
#define pow_(X, E) pow(X, E)
#define less_(A, B) ((A) < (B))
#define and_(A, B) ((A) && (B))
#define or_(A, B) ((A) || (B))
#define not_(A) (!(A))
#define select_(M, A, B) ((M) ? (A) : (B))
#define any_(M) (M)
#define to_int(X) int(X)
#define to_float(X) float(X)

#endif
