
/* The interface of FMI 3.0 (Modelica Association, 2022): the types that it names, and its functions. */

#ifdef FMI3_FUNCTION_PREFIX
#define MODEL_JOIN_(a, b) a##b
#define MODEL_JOIN(a, b) MODEL_JOIN_(a, b)
#define FMI3(name) MODEL_JOIN(FMI3_FUNCTION_PREFIX, fmi3##name)
#else
#define FMI3(name) fmi3##name
#endif
#define MODEL_FMI3 MODEL_EXPORT fmi3Status

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef const char *fmi3String;
typedef bool fmi3Boolean;
typedef bool fmi3Clock;
typedef double fmi3Float64;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef int fmi3DependencyKind;
typedef int fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(
    fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean, fmi3Boolean, fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3LockCallback)(void);

typedef struct {
    MODEL_Core core;
    bool logging;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} MODEL_Instance;

static fmi3Status MODEL_failure(MODEL_Instance *it, fmi3Status status, const char *why)
{
    if (it->log)
        it->log(it->environment, status, "logStatusError", why);
    return status;
}

/* OK, or the status of a failure with the reason that the model gave; says once that the data have been left. */
static fmi3Status MODEL_status(MODEL_Instance *it, bool succeeded, fmi3Status failure)
{
    if (!succeeded)
        return MODEL_failure(it, failure, it->core.failure);
    if (it->core.outside == 1 && it->logging && it->log) {
        it->log(it->environment, fmi3Warning, "logStatusWarning", "a state lies outside of the data that the model was learned from");
        it->core.outside = 2;
    }
    return fmi3OK;
}

static fmi3Instance MODEL_instantiate(
    fmi3String token, bool logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    MODEL_Instance *it;
    if (!token || strcmp(token, MODEL_TOKEN) != 0) {
        if (log)
            log(environment, fmi3Error, "logStatusError", "the instantiation token is not that of this model");
        return NULL;
    }
    it = calloc(1, sizeof *it);
    if (!it)
        return NULL;
    it->logging = logging;
    it->environment = environment;
    it->log = log;
    MODEL_reset(&it->core);
    return it;
}

MODEL_EXPORT const char *FMI3(GetVersion)(void) { return "3.0"; }

MODEL_EXPORT fmi3Instance FMI3(InstantiateModelExchange)(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    (void)name, (void)resources, (void)visible;
    return MODEL_instantiate(token, logging, environment, log);
}

MODEL_EXPORT fmi3Instance FMI3(InstantiateCoSimulation)(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference *intermediate, size_t count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    (void)name, (void)resources, (void)visible, (void)early, (void)intermediate, (void)update;
    if (events || count > 0) {
        if (log)
            log(environment, fmi3Error, "logStatusError", "this model has neither events nor intermediate values");
        return NULL;
    }
    return MODEL_instantiate(token, logging, environment, log);
}

MODEL_EXPORT fmi3Instance FMI3(InstantiateScheduledExecution)(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback clock, fmi3LockCallback lock, fmi3LockCallback unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)clock, (void)lock, (void)unlock;
    if (log)
        log(environment, fmi3Error, "logStatusError", "this model has no scheduled execution");
    return NULL;
}

MODEL_EXPORT void FMI3(FreeInstance)(fmi3Instance instance) { free(instance); }

MODEL_FMI3 FMI3(SetDebugLogging)(fmi3Instance instance, fmi3Boolean logging, size_t count, const fmi3String *categories)
{
    (void)count, (void)categories;
    ((MODEL_Instance *)instance)->logging = logging;
    return fmi3OK;
}

MODEL_FMI3 FMI3(EnterInitializationMode)(fmi3Instance instance, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
    fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop)
{
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    ((MODEL_Instance *)instance)->core.now.time = start;
    return fmi3OK;
}

MODEL_FMI3 FMI3(Reset)(fmi3Instance instance)
{
    MODEL_reset(&((MODEL_Instance *)instance)->core);
    return fmi3OK;
}

/* Changes of mode, which nothing depends on. */
#define MODEL_FMI3_MODE(name)                                                                                         \
    MODEL_FMI3 FMI3(name)(fmi3Instance instance) { return (void)instance, fmi3OK; }
MODEL_FMI3_MODE(ExitInitializationMode)
MODEL_FMI3_MODE(EnterEventMode)
MODEL_FMI3_MODE(EnterContinuousTimeMode)
MODEL_FMI3_MODE(EnterStepMode)
MODEL_FMI3_MODE(EnterConfigurationMode)
MODEL_FMI3_MODE(ExitConfigurationMode)
MODEL_FMI3_MODE(EvaluateDiscreteStates)
MODEL_FMI3_MODE(Terminate)

MODEL_FMI3 FMI3(GetFloat64)(
    fmi3Instance instance, const fmi3ValueReference *references, size_t count, fmi3Float64 *values, size_t value_count)
{
    MODEL_Instance *it = instance;
    bool good = true;
    size_t k;
    if (count != value_count)
        return MODEL_failure(it, fmi3Error, "every variable has one value");
    for (k = 0; good && k < count; ++k)
        good = MODEL_get(&it->core, references[k], &values[k]);
    return MODEL_status(it, good, fmi3Error);
}

MODEL_FMI3 FMI3(SetFloat64)(
    fmi3Instance instance, const fmi3ValueReference *references, size_t count, const fmi3Float64 *values, size_t value_count)
{
    MODEL_Instance *it = instance;
    bool good = true;
    size_t k;
    if (count != value_count)
        return MODEL_failure(it, fmi3Error, "every variable has one value");
    for (k = 0; good && k < count; ++k)
        good = MODEL_set(&it->core, references[k], values[k]);
    return MODEL_status(it, good, fmi3Error);
}

/* There are variables of no other type. */
static fmi3Status MODEL_none(fmi3Instance instance, size_t count)
{
    return count == 0 ? fmi3OK : MODEL_failure(instance, fmi3Error, "all variables of this model are of the type Float64");
}

#define MODEL_FMI3_NO(Type, type)                                                                                     \
    MODEL_FMI3 FMI3(Get##Type)(                                                                                       \
        fmi3Instance instance, const fmi3ValueReference *references, size_t count, type *values, size_t value_count)  \
    {                                                                                                                 \
        return (void)references, (void)values, (void)value_count, MODEL_none(instance, count);                        \
    }                                                                                                                 \
    MODEL_FMI3 FMI3(Set##Type)(                                                                                       \
        fmi3Instance instance, const fmi3ValueReference *references, size_t count, const type *values, size_t value_count) \
    {                                                                                                                 \
        return (void)references, (void)values, (void)value_count, MODEL_none(instance, count);                        \
    }
MODEL_FMI3_NO(Float32, float)
MODEL_FMI3_NO(Int8, int8_t)
MODEL_FMI3_NO(UInt8, uint8_t)
MODEL_FMI3_NO(Int16, int16_t)
MODEL_FMI3_NO(UInt16, uint16_t)
MODEL_FMI3_NO(Int32, int32_t)
MODEL_FMI3_NO(UInt32, uint32_t)
MODEL_FMI3_NO(Int64, int64_t)
MODEL_FMI3_NO(UInt64, uint64_t)
MODEL_FMI3_NO(Boolean, fmi3Boolean)
MODEL_FMI3_NO(String, fmi3String)

MODEL_FMI3 FMI3(GetBinary)(
    fmi3Instance instance, const fmi3ValueReference *references, size_t count, size_t *sizes, fmi3Binary *values, size_t value_count)
{
    return (void)references, (void)sizes, (void)values, (void)value_count, MODEL_none(instance, count);
}

MODEL_FMI3 FMI3(SetBinary)(fmi3Instance instance, const fmi3ValueReference *references, size_t count, const size_t *sizes,
    const fmi3Binary *values, size_t value_count)
{
    return (void)references, (void)sizes, (void)values, (void)value_count, MODEL_none(instance, count);
}

/* Functions of clocks: name and the arguments after their number. */
#define MODEL_FMI3_NO_CLOCK(name, ...)                                                                                \
    MODEL_FMI3 FMI3(name)(fmi3Instance instance, const fmi3ValueReference *references, size_t count, __VA_ARGS__)
MODEL_FMI3_NO_CLOCK(GetClock, fmi3Clock *values) { return (void)references, (void)values, MODEL_none(instance, count); }
MODEL_FMI3_NO_CLOCK(SetClock, const fmi3Clock *values) { return (void)references, (void)values, MODEL_none(instance, count); }
MODEL_FMI3_NO_CLOCK(GetIntervalDecimal, fmi3Float64 *intervals, fmi3IntervalQualifier *qualifiers)
{
    return (void)references, (void)intervals, (void)qualifiers, MODEL_none(instance, count);
}
MODEL_FMI3_NO_CLOCK(GetIntervalFraction, uint64_t *counters, uint64_t *resolutions, fmi3IntervalQualifier *qualifiers)
{
    return (void)references, (void)counters, (void)resolutions, (void)qualifiers, MODEL_none(instance, count);
}
MODEL_FMI3_NO_CLOCK(GetShiftDecimal, fmi3Float64 *shifts) { return (void)references, (void)shifts, MODEL_none(instance, count); }
MODEL_FMI3_NO_CLOCK(GetShiftFraction, uint64_t *counters, uint64_t *resolutions)
{
    return (void)references, (void)counters, (void)resolutions, MODEL_none(instance, count);
}
MODEL_FMI3_NO_CLOCK(SetIntervalDecimal, const fmi3Float64 *intervals)
{
    return (void)references, (void)intervals, MODEL_none(instance, count);
}
MODEL_FMI3_NO_CLOCK(SetIntervalFraction, const uint64_t *counters, const uint64_t *resolutions)
{
    return (void)references, (void)counters, (void)resolutions, MODEL_none(instance, count);
}
MODEL_FMI3_NO_CLOCK(SetShiftDecimal, const fmi3Float64 *shifts) { return (void)references, (void)shifts, MODEL_none(instance, count); }
MODEL_FMI3_NO_CLOCK(SetShiftFraction, const uint64_t *counters, const uint64_t *resolutions)
{
    return (void)references, (void)counters, (void)resolutions, MODEL_none(instance, count);
}

MODEL_FMI3 FMI3(ActivateModelPartition)(fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time)
{
    return (void)clock, (void)time, MODEL_none(instance, 1);
}

/* Dependencies are in modelDescription.xml and never change. */
MODEL_FMI3 FMI3(GetNumberOfVariableDependencies)(fmi3Instance instance, fmi3ValueReference reference, size_t *count)
{
    return (void)reference, (void)count, MODEL_failure(instance, fmi3Error, "dependencies are in modelDescription.xml");
}

MODEL_FMI3 FMI3(GetVariableDependencies)(fmi3Instance instance, fmi3ValueReference dependent, size_t *elements,
    fmi3ValueReference *independents, size_t *independent_elements, fmi3DependencyKind *kinds, size_t count)
{
    (void)dependent, (void)elements, (void)independents, (void)independent_elements, (void)kinds, (void)count;
    return MODEL_failure(instance, fmi3Error, "dependencies are in modelDescription.xml");
}

MODEL_FMI3 FMI3(GetFMUState)(fmi3Instance instance, fmi3FMUState *state)
{
    MODEL_Instance *it = instance;
    if (!*state)
        *state = calloc(1, sizeof(MODEL_Values));
    if (!*state)
        return MODEL_failure(it, fmi3Error, "there is no memory for a state");
    memcpy(*state, &it->core.now, sizeof(MODEL_Values));
    return fmi3OK;
}

MODEL_FMI3 FMI3(SetFMUState)(fmi3Instance instance, fmi3FMUState state)
{
    MODEL_restore(&((MODEL_Instance *)instance)->core, state);
    return fmi3OK;
}

MODEL_FMI3 FMI3(FreeFMUState)(fmi3Instance instance, fmi3FMUState *state)
{
    (void)instance;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

MODEL_FMI3 FMI3(SerializedFMUStateSize)(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    (void)instance, (void)state;
    *size = sizeof(MODEL_Values);
    return fmi3OK;
}

MODEL_FMI3 FMI3(SerializeFMUState)(fmi3Instance instance, fmi3FMUState state, fmi3Byte *bytes, size_t size)
{
    if (size != sizeof(MODEL_Values))
        return MODEL_failure(instance, fmi3Error, "a stored state of this model has another size");
    memcpy(bytes, state, size);
    return fmi3OK;
}

MODEL_FMI3 FMI3(DeserializeFMUState)(fmi3Instance instance, const fmi3Byte *bytes, size_t size, fmi3FMUState *state)
{
    if (size != sizeof(MODEL_Values))
        return MODEL_failure(instance, fmi3Error, "a stored state of this model has another size");
    if (!*state)
        *state = calloc(1, size);
    if (!*state)
        return MODEL_failure(instance, fmi3Error, "there is no memory for a state");
    memcpy(*state, bytes, size);
    return fmi3OK;
}

MODEL_FMI3 FMI3(GetDirectionalDerivative)(fmi3Instance instance, const fmi3ValueReference *unknowns, size_t unknown_count,
    const fmi3ValueReference *knowns, size_t known_count, const fmi3Float64 *seed, size_t seed_count, fmi3Float64 *sensitivity,
    size_t sensitivity_count)
{
    MODEL_Instance *it = instance;
#if MODEL_HAS_SLOPES
    MODEL_Direction along = {{0.0}, {0.0}};
    bool good = seed_count == known_count && sensitivity_count == unknown_count;
    size_t k;
    if (!good)
        return MODEL_failure(it, fmi3Error, "every variable has one value");
    for (k = 0; good && k < known_count; ++k)
        good = MODEL_add_direction(&it->core, &along, knowns[k], seed[k]);
    return MODEL_status(it, good && MODEL_directional(&it->core, &along, unknowns, unknown_count, sensitivity), fmi3Error);
#else
    (void)unknowns, (void)unknown_count, (void)knowns, (void)known_count, (void)seed, (void)seed_count, (void)sensitivity;
    (void)sensitivity_count;
    return MODEL_failure(it, fmi3Error, "this model has no derivatives");
#endif
}

MODEL_FMI3 FMI3(GetAdjointDerivative)(fmi3Instance instance, const fmi3ValueReference *unknowns, size_t unknown_count,
    const fmi3ValueReference *knowns, size_t known_count, const fmi3Float64 *seed, size_t seed_count, fmi3Float64 *sensitivity,
    size_t sensitivity_count)
{
    (void)unknowns, (void)unknown_count, (void)knowns, (void)known_count, (void)seed, (void)seed_count, (void)sensitivity;
    (void)sensitivity_count;
    return MODEL_failure(instance, fmi3Error, "this model has directional derivatives, not adjoint ones");
}

MODEL_FMI3 FMI3(UpdateDiscreteStates)(fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals,
    fmi3Boolean *states, fmi3Boolean *next_defined, fmi3Float64 *next)
{
    (void)instance;
    *again = *end = *nominals = *states = *next_defined = false;
    *next = 0.0;
    return fmi3OK;
}

MODEL_FMI3 FMI3(CompletedIntegratorStep)(fmi3Instance instance, fmi3Boolean no_return, fmi3Boolean *event, fmi3Boolean *end)
{
    (void)instance, (void)no_return;
    *event = *end = false;
    return fmi3OK;
}

MODEL_FMI3 FMI3(SetTime)(fmi3Instance instance, fmi3Float64 time)
{
    ((MODEL_Instance *)instance)->core.now.time = time;
    return fmi3OK;
}

MODEL_FMI3 FMI3(SetContinuousStates)(fmi3Instance instance, const fmi3Float64 *states, size_t count)
{
    if (count != MODEL_STATES)
        return MODEL_failure(instance, fmi3Error, "the number of states is another");
    MODEL_set_state(&((MODEL_Instance *)instance)->core, states);
    return fmi3OK;
}

MODEL_FMI3 FMI3(GetContinuousStates)(fmi3Instance instance, fmi3Float64 *states, size_t count)
{
    if (count != MODEL_STATES)
        return MODEL_failure(instance, fmi3Error, "the number of states is another");
    memcpy(states, ((MODEL_Instance *)instance)->core.now.state, sizeof(double[MODEL_STATES]));
    return fmi3OK;
}

/* A state that the model has no accelerations for is discarded: the solver may try a shorter step. */
MODEL_FMI3 FMI3(GetContinuousStateDerivatives)(fmi3Instance instance, fmi3Float64 *derivatives, size_t count)
{
    MODEL_Instance *it = instance;
    if (count != MODEL_STATES)
        return MODEL_failure(it, fmi3Error, "the number of states is another");
    if (!MODEL_know(&it->core))
        return MODEL_status(it, false, fmi3Discard);
    memcpy(derivatives, it->core.now.state + MODEL_N, sizeof(double[MODEL_N]));
    memcpy(derivatives + MODEL_N, it->core.qdd, sizeof(double[MODEL_N]));
    return MODEL_status(it, true, fmi3OK);
}

MODEL_FMI3 FMI3(GetNominalsOfContinuousStates)(fmi3Instance instance, fmi3Float64 *nominals, size_t count)
{
    size_t k;
    if (count != MODEL_STATES)
        return MODEL_failure(instance, fmi3Error, "the number of states is another");
    for (k = 0; k < count; ++k)
        nominals[k] = 1.0;
    return fmi3OK;
}

MODEL_FMI3 FMI3(GetEventIndicators)(fmi3Instance instance, fmi3Float64 *indicators, size_t count)
{
    (void)indicators;
    return count == 0 ? fmi3OK : MODEL_failure(instance, fmi3Error, "this model has no events");
}

MODEL_FMI3 FMI3(GetNumberOfEventIndicators)(fmi3Instance instance, size_t *count)
{
    (void)instance;
    *count = 0;
    return fmi3OK;
}

MODEL_FMI3 FMI3(GetNumberOfContinuousStates)(fmi3Instance instance, size_t *count)
{
    (void)instance;
    *count = MODEL_STATES;
    return fmi3OK;
}

MODEL_FMI3 FMI3(GetOutputDerivatives)(fmi3Instance instance, const fmi3ValueReference *references, size_t count,
    const int32_t *orders, fmi3Float64 *values, size_t value_count)
{
    (void)references, (void)count, (void)orders, (void)values, (void)value_count;
    return MODEL_failure(instance, fmi3Error, "this model gives no derivatives of outputs in time");
}

MODEL_FMI3 FMI3(DoStep)(fmi3Instance instance, fmi3Float64 time, fmi3Float64 length, fmi3Boolean no_return, fmi3Boolean *event,
    fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *last)
{
    MODEL_Instance *it = instance;
    const bool good = MODEL_advance(&it->core, length);
    (void)no_return;
    *event = *end = *early = false;
    *last = good ? time + length : time;
    it->core.now.time = *last;
    return MODEL_status(it, good, fmi3Error);
}
