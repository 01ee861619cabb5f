
/* The interface of FMI 2.0 (Modelica Association, 2014): the types that it names, and its functions. */

#include <stdarg.h>

#ifdef FMI2_FUNCTION_PREFIX
#define MODEL_JOIN_(a, b) a##b
#define MODEL_JOIN(a, b) MODEL_JOIN_(a, b)
#define FMI2(name) MODEL_JOIN(FMI2_FUNCTION_PREFIX, fmi2##name)
#else
#define FMI2(name) fmi2##name
#endif
#define MODEL_FMI2 MODEL_EXPORT fmi2Status

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef int fmi2Type;
typedef int fmi2StatusKind;

typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String name, fmi2Status, fmi2String category, fmi2String format, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    fmi2Boolean newDiscreteStatesNeeded;
    fmi2Boolean terminateSimulation;
    fmi2Boolean nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged;
    fmi2Boolean nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

typedef struct {
    MODEL_Core core;
    bool logging;
    const fmi2CallbackFunctions *callbacks;
    char name[64];
} MODEL_Instance;

static void MODEL_say(const MODEL_Instance *it, fmi2Status status, const char *category, const char *what)
{
    if (it->callbacks && it->callbacks->logger)
        it->callbacks->logger(it->callbacks->componentEnvironment, it->name, status, category, "%s", what);
}

static fmi2Status MODEL_failure(MODEL_Instance *it, fmi2Status status, const char *why)
{
    MODEL_say(it, status, "logStatusError", why);
    return status;
}

/* OK, or the status of a failure with the reason that the model gave; says once that the data have been left. */
static fmi2Status MODEL_status(MODEL_Instance *it, bool succeeded, fmi2Status failure)
{
    if (!succeeded)
        return MODEL_failure(it, failure, it->core.failure);
    if (it->core.outside == 1 && it->logging) {
        MODEL_say(it, fmi2Warning, "logStatusWarning", "a state lies outside of the data that the model was learned from");
        it->core.outside = 2;
    }
    return fmi2OK;
}

MODEL_EXPORT const char *FMI2(GetTypesPlatform)(void) { return "default"; }
MODEL_EXPORT const char *FMI2(GetVersion)(void) { return "2.0"; }

MODEL_EXPORT fmi2Component FMI2(Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
    const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    MODEL_Instance *it = calloc(1, sizeof *it);
    (void)type, (void)resources, (void)visible;
    if (!it)
        return NULL;
    it->callbacks = callbacks;
    it->logging = logging != 0;
    if (name)
        strncpy(it->name, name, sizeof it->name - 1);
    if (!guid || strcmp(guid, MODEL_TOKEN) != 0) {
        MODEL_say(it, fmi2Error, "logStatusError", "the GUID is not that of this model");
        free(it);
        return NULL;
    }
    MODEL_reset(&it->core);
    return it;
}

MODEL_EXPORT void FMI2(FreeInstance)(fmi2Component c) { free(c); }

MODEL_FMI2 FMI2(SetDebugLogging)(fmi2Component c, fmi2Boolean logging, size_t count, const fmi2String *categories)
{
    (void)count, (void)categories;
    ((MODEL_Instance *)c)->logging = logging != 0;
    return fmi2OK;
}

MODEL_FMI2 FMI2(SetupExperiment)(
    fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop)
{
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    ((MODEL_Instance *)c)->core.now.time = start;
    return fmi2OK;
}

MODEL_FMI2 FMI2(Reset)(fmi2Component c)
{
    MODEL_reset(&((MODEL_Instance *)c)->core);
    return fmi2OK;
}

/* Changes of mode, which nothing depends on. */
#define MODEL_FMI2_MODE(name)                                                                                         \
    MODEL_FMI2 FMI2(name)(fmi2Component c) { return (void)c, fmi2OK; }
MODEL_FMI2_MODE(EnterInitializationMode)
MODEL_FMI2_MODE(ExitInitializationMode)
MODEL_FMI2_MODE(EnterEventMode)
MODEL_FMI2_MODE(EnterContinuousTimeMode)
MODEL_FMI2_MODE(Terminate)

MODEL_FMI2 FMI2(GetReal)(fmi2Component c, const fmi2ValueReference *references, size_t count, fmi2Real *values)
{
    MODEL_Instance *it = c;
    bool good = true;
    size_t k;
    for (k = 0; good && k < count; ++k)
        good = MODEL_get(&it->core, references[k], &values[k]);
    return MODEL_status(it, good, fmi2Error);
}

MODEL_FMI2 FMI2(SetReal)(fmi2Component c, const fmi2ValueReference *references, size_t count, const fmi2Real *values)
{
    MODEL_Instance *it = c;
    bool good = true;
    size_t k;
    for (k = 0; good && k < count; ++k)
        good = MODEL_set(&it->core, references[k], values[k]);
    return MODEL_status(it, good, fmi2Error);
}

/* There are variables of no other type. */
static fmi2Status MODEL_none(fmi2Component c, size_t count)
{
    return count == 0 ? fmi2OK : MODEL_failure(c, fmi2Error, "all variables of this model are of the type Real");
}

#define MODEL_FMI2_NO(Type, type)                                                                                     \
    MODEL_FMI2 FMI2(Get##Type)(fmi2Component c, const fmi2ValueReference *references, size_t count, type *values)     \
    {                                                                                                                 \
        return (void)references, (void)values, MODEL_none(c, count);                                                  \
    }                                                                                                                 \
    MODEL_FMI2 FMI2(Set##Type)(fmi2Component c, const fmi2ValueReference *references, size_t count, const type *values) \
    {                                                                                                                 \
        return (void)references, (void)values, MODEL_none(c, count);                                                  \
    }
MODEL_FMI2_NO(Integer, fmi2Integer)
MODEL_FMI2_NO(Boolean, fmi2Boolean)
MODEL_FMI2_NO(String, fmi2String)

MODEL_FMI2 FMI2(GetFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    MODEL_Instance *it = c;
    if (!*state)
        *state = calloc(1, sizeof(MODEL_Values));
    if (!*state)
        return MODEL_failure(it, fmi2Error, "there is no memory for a state");
    memcpy(*state, &it->core.now, sizeof(MODEL_Values));
    return fmi2OK;
}

MODEL_FMI2 FMI2(SetFMUstate)(fmi2Component c, fmi2FMUstate state)
{
    MODEL_restore(&((MODEL_Instance *)c)->core, state);
    return fmi2OK;
}

MODEL_FMI2 FMI2(FreeFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

MODEL_FMI2 FMI2(SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(MODEL_Values);
    return fmi2OK;
}

MODEL_FMI2 FMI2(SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte *bytes, size_t size)
{
    if (size != sizeof(MODEL_Values))
        return MODEL_failure(c, fmi2Error, "a stored state of this model has another size");
    memcpy(bytes, state, size);
    return fmi2OK;
}

MODEL_FMI2 FMI2(DeSerializeFMUstate)(fmi2Component c, const fmi2Byte *bytes, size_t size, fmi2FMUstate *state)
{
    if (size != sizeof(MODEL_Values))
        return MODEL_failure(c, fmi2Error, "a stored state of this model has another size");
    if (!*state)
        *state = calloc(1, size);
    if (!*state)
        return MODEL_failure(c, fmi2Error, "there is no memory for a state");
    memcpy(*state, bytes, size);
    return fmi2OK;
}

MODEL_FMI2 FMI2(GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference *unknowns, size_t unknown_count,
    const fmi2ValueReference *knowns, size_t known_count, const fmi2Real *seed, fmi2Real *sensitivity)
{
    MODEL_Instance *it = c;
#if MODEL_HAS_SLOPES
    MODEL_Direction along = {{0.0}, {0.0}};
    bool good = true;
    size_t k;
    for (k = 0; good && k < known_count; ++k)
        good = MODEL_add_direction(&it->core, &along, knowns[k], seed[k]);
    return MODEL_status(it, good && MODEL_directional(&it->core, &along, unknowns, unknown_count, sensitivity), fmi2Error);
#else
    (void)unknowns, (void)unknown_count, (void)knowns, (void)known_count, (void)seed, (void)sensitivity;
    return MODEL_failure(it, fmi2Error, "this model has no derivatives");
#endif
}

MODEL_FMI2 FMI2(NewDiscreteStates)(fmi2Component c, fmi2EventInfo *event)
{
    (void)c;
    memset(event, 0, sizeof *event);
    return fmi2OK;
}

MODEL_FMI2 FMI2(CompletedIntegratorStep)(fmi2Component c, fmi2Boolean no_return, fmi2Boolean *event, fmi2Boolean *end)
{
    (void)c, (void)no_return;
    *event = *end = 0;
    return fmi2OK;
}

MODEL_FMI2 FMI2(SetTime)(fmi2Component c, fmi2Real time)
{
    ((MODEL_Instance *)c)->core.now.time = time;
    return fmi2OK;
}

MODEL_FMI2 FMI2(SetContinuousStates)(fmi2Component c, const fmi2Real *states, size_t count)
{
    if (count != MODEL_STATES)
        return MODEL_failure(c, fmi2Error, "the number of states is another");
    MODEL_set_state(&((MODEL_Instance *)c)->core, states);
    return fmi2OK;
}

MODEL_FMI2 FMI2(GetContinuousStates)(fmi2Component c, fmi2Real *states, size_t count)
{
    if (count != MODEL_STATES)
        return MODEL_failure(c, fmi2Error, "the number of states is another");
    memcpy(states, ((MODEL_Instance *)c)->core.now.state, sizeof(double[MODEL_STATES]));
    return fmi2OK;
}

/* A state that the model has no accelerations for is discarded: the solver may try a shorter step. */
MODEL_FMI2 FMI2(GetDerivatives)(fmi2Component c, fmi2Real *derivatives, size_t count)
{
    MODEL_Instance *it = c;
    if (count != MODEL_STATES)
        return MODEL_failure(it, fmi2Error, "the number of states is another");
    if (!MODEL_know(&it->core))
        return MODEL_status(it, false, fmi2Discard);
    memcpy(derivatives, it->core.now.state + MODEL_N, sizeof(double[MODEL_N]));
    memcpy(derivatives + MODEL_N, it->core.qdd, sizeof(double[MODEL_N]));
    return MODEL_status(it, true, fmi2OK);
}

MODEL_FMI2 FMI2(GetNominalsOfContinuousStates)(fmi2Component c, fmi2Real *nominals, size_t count)
{
    size_t k;
    if (count != MODEL_STATES)
        return MODEL_failure(c, fmi2Error, "the number of states is another");
    for (k = 0; k < count; ++k)
        nominals[k] = 1.0;
    return fmi2OK;
}

MODEL_FMI2 FMI2(GetEventIndicators)(fmi2Component c, fmi2Real *indicators, size_t count)
{
    (void)indicators;
    return count == 0 ? fmi2OK : MODEL_failure(c, fmi2Error, "this model has no events");
}

MODEL_FMI2 FMI2(SetRealInputDerivatives)(
    fmi2Component c, const fmi2ValueReference *references, size_t count, const fmi2Integer *orders, const fmi2Real *values)
{
    (void)references, (void)orders, (void)values;
    return count == 0 ? fmi2OK : MODEL_failure(c, fmi2Error, "inputs are constant during a step");
}

MODEL_FMI2 FMI2(GetRealOutputDerivatives)(
    fmi2Component c, const fmi2ValueReference *references, size_t count, const fmi2Integer *orders, fmi2Real *values)
{
    (void)references, (void)orders, (void)values;
    return count == 0 ? fmi2OK : MODEL_failure(c, fmi2Error, "this model gives no derivatives of outputs in time");
}

MODEL_FMI2 FMI2(DoStep)(fmi2Component c, fmi2Real time, fmi2Real length, fmi2Boolean no_return)
{
    MODEL_Instance *it = c;
    const bool good = MODEL_advance(&it->core, length);
    (void)no_return;
    it->core.now.time = good ? time + length : time;
    return MODEL_status(it, good, fmi2Error);
}

MODEL_FMI2 FMI2(CancelStep)(fmi2Component c) { return MODEL_failure(c, fmi2Error, "steps are not asynchronous"); }

/* Nothing is pending: a step has ended when its function returns. */
#define MODEL_FMI2_STATUS(name, type)                                                                                 \
    MODEL_FMI2 FMI2(name)(fmi2Component c, fmi2StatusKind kind, type *value)                                          \
    {                                                                                                                 \
        return (void)kind, (void)value, MODEL_failure(c, fmi2Discard, "steps are not asynchronous");                  \
    }
MODEL_FMI2_STATUS(GetStatus, fmi2Status)
MODEL_FMI2_STATUS(GetRealStatus, fmi2Real)
MODEL_FMI2_STATUS(GetIntegerStatus, fmi2Integer)
MODEL_FMI2_STATUS(GetBooleanStatus, fmi2Boolean)
MODEL_FMI2_STATUS(GetStringStatus, fmi2String)
