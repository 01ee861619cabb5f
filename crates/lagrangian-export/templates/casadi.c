/* CasADi's external functions of a model: how they are described, and how arrays go in and out.
 *
 * CasADi passes vectors of doubles and dense matrices by columns, NULL for an argument of zeros and NULL for a result that
 * nobody asked for (user guide, "Using the generated code"). A failure is a nonzero return value; a state outside
 * of the data is none.
 */
#include "MODEL.h"

#ifdef MODEL_FLOAT
#error "CasADi computes in double precision: compile MODEL.c and this file without MODEL_FLOAT"
#endif

#ifndef casadi_real
#define casadi_real double
#endif
#ifndef casadi_int
#define casadi_int long long int
#endif

#if defined(_WIN32) || defined(__CYGWIN__)
#define MODEL_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define MODEL_EXPORT __attribute__((visibility("default")))
#else
#define MODEL_EXPORT
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Rows, columns, and a third number: 1 for a dense matrix; for an empty column, where its entries begin and end. */
typedef struct {
    const char *name;
    casadi_int sparsity[4];
} MODEL_Slot;

static const casadi_real MODEL_zeros[MODEL_N] = {0.0};

static const casadi_real *MODEL_argument(const casadi_real *values) { return values ? values : MODEL_zeros; }

/* Copies a matrix by rows to one by columns, where it was asked for. */
static void MODEL_result(casadi_real *by_columns, const casadi_real *by_rows, int rows, int columns)
{
    int i, j;
    if (!by_columns)
        return;
    for (j = 0; j < columns; ++j)
        for (i = 0; i < rows; ++i)
            by_columns[j * rows + i] = by_rows[i * columns + j];
}

static int MODEL_failed(int status) { return status != MODEL_OK && status != MODEL_OUTSIDE; }

/* What CasADi asks about a function: its arguments and results, and the numbers that it needs as working memory. */
#define MODEL_DESCRIBE(function, arguments, results, memory)                                                          \
    MODEL_EXPORT int function(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem);    \
    MODEL_EXPORT void function##_incref(void) {}                                                                      \
    MODEL_EXPORT void function##_decref(void) {}                                                                      \
    MODEL_EXPORT casadi_int function##_n_in(void) { return (casadi_int)(sizeof arguments / sizeof *arguments); }      \
    MODEL_EXPORT casadi_int function##_n_out(void) { return (casadi_int)(sizeof results / sizeof *results); }         \
    MODEL_EXPORT casadi_real function##_default_in(casadi_int i) { return (void)i, 0.0; }                             \
    MODEL_EXPORT const char *function##_name_in(casadi_int i)                                                         \
    {                                                                                                                 \
        return i >= 0 && i < function##_n_in() ? arguments[i].name : 0;                                               \
    }                                                                                                                 \
    MODEL_EXPORT const char *function##_name_out(casadi_int i)                                                        \
    {                                                                                                                 \
        return i >= 0 && i < function##_n_out() ? results[i].name : 0;                                                \
    }                                                                                                                 \
    MODEL_EXPORT const casadi_int *function##_sparsity_in(casadi_int i)                                               \
    {                                                                                                                 \
        return i >= 0 && i < function##_n_in() ? arguments[i].sparsity : 0;                                           \
    }                                                                                                                 \
    MODEL_EXPORT const casadi_int *function##_sparsity_out(casadi_int i)                                              \
    {                                                                                                                 \
        return i >= 0 && i < function##_n_out() ? results[i].sparsity : 0;                                            \
    }                                                                                                                 \
    MODEL_EXPORT int function##_work(casadi_int *sz_arg, casadi_int *sz_res, casadi_int *sz_iw, casadi_int *sz_w)      \
    {                                                                                                                 \
        if (sz_arg)                                                                                                   \
            *sz_arg = function##_n_in();                                                                              \
        if (sz_res)                                                                                                   \
            *sz_res = function##_n_out();                                                                             \
        if (sz_iw)                                                                                                    \
            *sz_iw = 0;                                                                                               \
        if (sz_w)                                                                                                     \
            *sz_w = (memory);                                                                                         \
        return 0;                                                                                                     \
    }

