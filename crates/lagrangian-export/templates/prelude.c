#include "NAME.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

typedef NAME_real real;

#define N NAME_N
#define C(x) ((real)(x))

#ifdef NAME_FLOAT
#define EPSILON FLT_EPSILON
#define SIN sinf
#define COS cosf
#define TANH tanhf
#define SQRT sqrtf
#define FABS fabsf
#define ERFC erfcf
#define ASIN asinf
#define ASINH asinhf
#define ATANH atanhf
#define FMOD fmodf
#else
#define EPSILON DBL_EPSILON
#define SIN sin
#define COS cos
#define TANH tanh
#define SQRT sqrt
#define FABS fabs
#define ERFC erfc
#define ASIN asin
#define ASINH asinh
#define ATANH atanh
#define FMOD fmod
#endif
