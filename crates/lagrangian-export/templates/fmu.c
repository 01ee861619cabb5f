/* A functional mock-up unit: the variables of a model, their derivatives, and its integration for co-simulation.
 *
 * States are q and qd, inputs are tau. The references of variables, with 1-based names, are
 *   time 0 · tau[i] i · then, for n joints each: q[i], qd[i], der(q[i]), qdd[i] · energy · distance_from_data.
 */
#include "MODEL.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32) || defined(__CYGWIN__)
#define MODEL_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define MODEL_EXPORT __attribute__((visibility("default")))
#else
#define MODEL_EXPORT
#endif

#define MODEL_STATES (2 * MODEL_N)

enum {
    MODEL_TIME = 0,
    MODEL_TAU = 1,
    MODEL_Q = MODEL_TAU + MODEL_NU,
    MODEL_QD = MODEL_Q + MODEL_N,
    MODEL_DER_Q = MODEL_QD + MODEL_N,
    MODEL_QDD = MODEL_DER_Q + MODEL_N,
    MODEL_ENERGY = MODEL_QDD + MODEL_N,
    MODEL_DISTANCE
};

/* All that a motion is known by. */
typedef struct {
    double time;
    double state[MODEL_STATES]; /* q, then qd */
    double tau[MODEL_NU];
} MODEL_Values;

typedef struct {
    MODEL_Values now;
    double qdd[MODEL_N];     /* of the values now, where they are known */
    int known;               /* whether qdd belongs to the values now */
    int outside;             /* whether a state was outside of the data since the last message */
    const char *failure;     /* why the last computation failed */
} MODEL_Core;

static void MODEL_reset(MODEL_Core *core)
{
    static const double start[MODEL_STATES] = {MODEL_START};
    memset(core, 0, sizeof *core);
    memcpy(core->now.state, start, sizeof start);
}

static void MODEL_narrow(MODEL_real *to, const double *from, int count)
{
    int i;
    for (i = 0; i < count; ++i)
        to[i] = (MODEL_real)from[i];
}

/* Whether a call of the model gave values; notes why it did not, and whether the state was outside of the data. */
static bool MODEL_succeeded(MODEL_Core *core, int status)
{
    if (status == MODEL_OUTSIDE)
        core->outside = 1;
    else if (status == MODEL_NOT_FINITE)
        core->failure = "the state or the result is not finite: use a shorter step, or smaller inputs";
    else if (status == MODEL_SINGULAR)
        core->failure = "the mass matrix is singular at this state: the model does not hold here";
    else if (status != MODEL_OK)
        core->failure = "the model failed for an unknown reason";
    return status == MODEL_OK || status == MODEL_OUTSIDE;
}

static bool MODEL_accelerations(MODEL_Core *core, const double *state, double *qdd)
{
    MODEL_real x[MODEL_STATES], tau[MODEL_NU], result[MODEL_N];
    int i;
    MODEL_narrow(x, state, MODEL_STATES);
    MODEL_narrow(tau, core->now.tau, MODEL_NU);
    if (!MODEL_succeeded(core, MODEL_forward_dynamics(x, x + MODEL_N, tau, result)))
        return false;
    for (i = 0; i < MODEL_N; ++i)
        qdd[i] = (double)result[i];
    return true;
}

static bool MODEL_know(MODEL_Core *core)
{
    if (!core->known)
        core->known = MODEL_accelerations(core, core->now.state, core->qdd);
    return core->known;
}

/* The energy, or how far the state is from the data. */
static bool MODEL_scalar(MODEL_Core *core, unsigned variable, const double *state, double *value)
{
    MODEL_real x[MODEL_STATES], result = 0;
    MODEL_narrow(x, state, MODEL_STATES);
    switch (variable) {
#if MODEL_HAS_ENERGY
    case MODEL_ENERGY:
        if (!MODEL_succeeded(core, MODEL_energy(x, x + MODEL_N, &result)))
            return false;
        break;
#endif
#if MODEL_HAS_DISTANCE
    case MODEL_DISTANCE:
        if (!MODEL_succeeded(core, MODEL_distance_from_data(x, x + MODEL_N, &result)))
            return false;
        break;
#endif
    default:
        core->failure = "there is no variable of this reference: see modelDescription.xml";
        return false;
    }
    *value = (double)result;
    return true;
}

static bool MODEL_get(MODEL_Core *core, unsigned variable, double *value)
{
    if (variable == MODEL_TIME)
        *value = core->now.time;
    else if (variable < MODEL_Q)
        *value = core->now.tau[variable - MODEL_TAU];
    else if (variable < MODEL_DER_Q)
        *value = core->now.state[variable - MODEL_Q];
    else if (variable < MODEL_QDD)
        *value = core->now.state[MODEL_N + variable - MODEL_DER_Q];
    else if (variable >= MODEL_ENERGY)
        return MODEL_scalar(core, variable, core->now.state, value);
    else if (!MODEL_know(core))
        return false;
    else
        *value = core->qdd[variable - MODEL_QDD];
    return true;
}

static bool MODEL_set(MODEL_Core *core, unsigned variable, double value)
{
    if (variable < MODEL_TAU || variable >= MODEL_DER_Q) {
        core->failure = "only inputs and states can be set: see modelDescription.xml";
        return false;
    }
    if (!isfinite(value)) {
        core->failure = "a value that is not finite cannot be set";
        return false;
    }
    if (variable < MODEL_Q)
        core->now.tau[variable - MODEL_TAU] = value;
    else
        core->now.state[variable - MODEL_Q] = value;
    core->known = 0;
    return true;
}

static void MODEL_set_state(MODEL_Core *core, const double *state)
{
    memcpy(core->now.state, state, sizeof core->now.state);
    core->known = 0;
}

static bool MODEL_rate(MODEL_Core *core, const double *state, double *rate)
{
    memcpy(rate, state + MODEL_N, MODEL_N * sizeof *rate);
    return MODEL_accelerations(core, state, rate + MODEL_N);
}

/* One step of the classical Runge-Kutta method from a state, with constant inputs. */
static bool MODEL_runge_kutta(MODEL_Core *core, double h, double *state)
{
    static const double node[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
    double rate[MODEL_STATES] = {0.0}, stage[MODEL_STATES], next[MODEL_STATES];
    int i, k;
    memcpy(next, state, sizeof next);
    for (k = 0; k < 4; ++k) {
        for (i = 0; i < MODEL_STATES; ++i)
            stage[i] = state[i] + h * node[k] * rate[i];
        if (!MODEL_rate(core, stage, rate))
            return false;
        for (i = 0; i < MODEL_STATES; ++i)
            next[i] += h * weight[k] * rate[i];
    }
    memcpy(state, next, sizeof next);
    return true;
}

/* Moves the model on in steps of at most MODEL_LONGEST_STEP s; where one fails, it stays where it was. */
static bool MODEL_advance(MODEL_Core *core, double duration)
{
    double state[MODEL_STATES];
    double steps = ceil(duration / MODEL_LONGEST_STEP);
    long k;
    if (!(duration >= 0.0 && steps <= 1e7)) {
        core->failure = "the length of a step must be between 0 s and 10000 s";
        return false;
    }
    memcpy(state, core->now.state, sizeof state);
    for (k = 0; k < (long)steps; ++k)
        if (!MODEL_runge_kutta(core, duration / steps, state))
            return false;
    MODEL_set_state(core, state);
    return true;
}

static void MODEL_restore(MODEL_Core *core, const MODEL_Values *values)
{
    core->now = *values;
    core->known = 0;
}

#if MODEL_HAS_SLOPES

/* A change of states and inputs. */
typedef struct {
    double state[MODEL_STATES];
    double tau[MODEL_NU];
} MODEL_Direction;

static bool MODEL_add_direction(MODEL_Core *core, MODEL_Direction *along, unsigned variable, double seed)
{
    if (variable >= MODEL_TAU && variable < MODEL_Q)
        along->tau[variable - MODEL_TAU] += seed;
    else if (variable >= MODEL_Q && variable < MODEL_DER_Q)
        along->state[variable - MODEL_Q] += seed;
    else if (variable != MODEL_TIME) {
        core->failure = "derivatives are known by inputs, states and the time only";
        return false;
    }
    return true;
}

/* How the accelerations change along a direction. */
static bool MODEL_slopes(MODEL_Core *core, const MODEL_Direction *along, double *slopes)
{
    MODEL_real x[MODEL_STATES], tau[MODEL_NU];
    MODEL_real by_q[MODEL_N * MODEL_N], by_qd[MODEL_N * MODEL_N], by_tau[MODEL_N * MODEL_NU];
    int i, j;
    MODEL_narrow(x, core->now.state, MODEL_STATES);
    MODEL_narrow(tau, core->now.tau, MODEL_NU);
    if (!MODEL_succeeded(core, MODEL_forward_dynamics_derivatives(x, x + MODEL_N, tau, by_q, by_qd, by_tau)))
        return false;
    for (i = 0; i < MODEL_N; ++i) {
        slopes[i] = 0.0;
        for (j = 0; j < MODEL_N; ++j)
            slopes[i] += (double)by_q[i * MODEL_N + j] * along->state[j]
                + (double)by_qd[i * MODEL_N + j] * along->state[MODEL_N + j];
        for (j = 0; j < MODEL_NU; ++j)
            slopes[i] += (double)by_tau[i * MODEL_NU + j] * along->tau[j];
    }
    return true;
}

/* A central difference of energy or distance along a direction of the state: they have no derivatives of their own. */
static bool MODEL_difference(MODEL_Core *core, unsigned variable, const MODEL_Direction *along, double *slope)
{
    const double relative = sizeof(MODEL_real) < sizeof(double) ? 1e-2 : 1e-5;
    double ahead[MODEL_STATES], behind[MODEL_STATES], length = 0.0, h, a, b;
    int i;
    *slope = 0.0;
    for (i = 0; i < MODEL_STATES; ++i)
        length = fmax(length, fabs(along->state[i]));
    if (!(length > 0.0))
        return MODEL_scalar(core, variable, core->now.state, &a);
    h = relative / length;
    for (i = 0; i < MODEL_STATES; ++i) {
        ahead[i] = core->now.state[i] + h * along->state[i];
        behind[i] = core->now.state[i] - h * along->state[i];
    }
    if (!MODEL_scalar(core, variable, ahead, &a) || !MODEL_scalar(core, variable, behind, &b))
        return false;
    *slope = (a - b) / (2.0 * h);
    return true;
}

/* The derivatives of some variables along a direction. */
static bool MODEL_directional(MODEL_Core *core, const MODEL_Direction *along, const unsigned *variables, size_t count, double *values)
{
    double slopes[MODEL_N];
    size_t k;
    if (!MODEL_slopes(core, along, slopes))
        return false;
    for (k = 0; k < count; ++k) {
        const unsigned variable = variables[k];
        if (variable < MODEL_Q) {
            core->failure = "derivatives are known of states, their rates and outputs only";
            return false;
        }
        if (variable < MODEL_DER_Q)
            values[k] = along->state[variable - MODEL_Q];
        else if (variable < MODEL_QDD)
            values[k] = along->state[MODEL_N + variable - MODEL_DER_Q];
        else if (variable < MODEL_ENERGY)
            values[k] = slopes[variable - MODEL_QDD];
        else if (!MODEL_difference(core, variable, along, &values[k]))
            return false;
    }
    return true;
}
#endif
