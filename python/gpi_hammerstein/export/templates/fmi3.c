/* The functions of FMI 3.0 (https://fmi-standard.org) for a system that is computed sample by sample.
 *
 * The step from time t computes one sample with the inputs that were set at t, or several samples if it is as
 * long. Inputs are held meanwhile. After the step, the outputs are those of its last sample.
 */
#include "$name.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined _WIN32
#define EXPORTED __declspec(dllexport)
#elif defined __GNUC__
#define EXPORTED __attribute__((visibility("default")))
#else
#define EXPORTED
#endif

#define TOKEN "$token"
#define INPUTS $inputs
#define OUTPUTS $outputs

/* How far a step may be from a whole number of samples, in samples: times are sums of rounded numbers. */
#define NEAR 1e-3

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void *fmi3Instance;
typedef uint32_t fmi3ValueReference;
typedef const char *fmi3String;
typedef void (*Log)(void *environment, fmi3Status status, fmi3String category, fmi3String message);

static const double rate = $rate;

/* What fmi3GetFMUState saves. */
typedef struct {
    ${name}_state state;
    enum { INSTANTIATED, INITIALIZING, STEPPING, TERMINATED } mode;
    double time;
    double inputs[INPUTS];
    double outputs[OUTPUTS];
} Values;

typedef struct {
    Values now;
    void *environment;
    Log log;
    bool logging;
} Instance;

static fmi3Status say(const Instance *own, fmi3Status status, const char *format, ...)
{
    char message[300];
    va_list values;
    va_start(values, format);
    vsnprintf(message, sizeof message, format, values);
    va_end(values);
    if (own->log && (own->logging || status >= fmi3Error))
        own->log(own->environment, status, status >= fmi3Error ? "error" : "warning", message);
    return status;
}

static void start(Values *now)
{
    ${name}_start(&now->state, $start_inputs);
}

static void step(Values *now)
{
@compensator
    now->outputs[0] = ${name}_step(&now->state, now->inputs[0]);
@end
@leak
    ${name}_step(&now->state, now->inputs, now->inputs + ${NAME}_INPUTS, now->outputs);
@end
@plain
    ${name}_step(&now->state, now->inputs, now->outputs);
@end
}

/* The outputs of the first sample; the state stays that of the start. */
static void look(Values *now)
{
    Values first;
    start(now);
    first = *now;
    step(&first);
    memcpy(now->outputs, first.outputs, sizeof now->outputs);
}

EXPORTED const char *fmi3GetVersion(void)
{
    return "3.0";
}

EXPORTED fmi3Status fmi3SetDebugLogging(
    fmi3Instance instance, bool on, size_t count, const fmi3String categories[])
{
    (void)count;
    (void)categories;
    ((Instance *)instance)->logging = on;
    return fmi3OK;
}

EXPORTED fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
    bool visible, bool logging, bool events, bool early, const fmi3ValueReference required[], size_t count,
    void *environment, Log log, void *update)
{
    Instance *own = calloc(1, sizeof *own);
    (void)name, (void)resources, (void)visible, (void)events, (void)early;
    (void)required, (void)count, (void)update;
    if (!own)
        return NULL;
    own->environment = environment;
    own->log = log;
    own->logging = logging;
    if (!token || strcmp(token, TOKEN) != 0) {
        say(own, fmi3Error, "the instantiation token is not that of modelDescription.xml, %s", TOKEN);
        free(own);
        return NULL;
    }
    return own;
}

EXPORTED void fmi3FreeInstance(fmi3Instance instance)
{
    free(instance);
}

EXPORTED fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, bool tolerance_defined, double tolerance,
    double start_time, bool stop_defined, double stop_time)
{
    Instance *own = instance;
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop_time;
    if (own->now.mode != INSTANTIATED)
        return say(own, fmi3Error, "the initialization begins after the instantiation or a reset");
    own->now.mode = INITIALIZING;
    own->now.time = start_time;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    Instance *own = instance;
    if (own->now.mode != INITIALIZING)
        return say(own, fmi3Error, "there is no initialization to end");
    look(&own->now);
    own->now.mode = STEPPING;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3Terminate(fmi3Instance instance)
{
    ((Instance *)instance)->now.mode = TERMINATED;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3Reset(fmi3Instance instance)
{
    static const Values zero;
    ((Instance *)instance)->now = zero;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3DoStep(fmi3Instance instance, double time, double length, bool no_way_back,
    bool *event, bool *terminate, bool *early, double *last)
{
    Instance *own = instance;
    const double wanted = length * rate;
    double whole;
    long count;
    int i;
    (void)no_way_back;
    *event = *terminate = *early = false;
    *last = own->now.time;
    if (own->now.mode != STEPPING)
        return say(own, fmi3Error, "a step needs an initialization before it");
    if (!(wanted > 0.5 && wanted < 1e9))
        return say(own, fmi3Error, "the step of %.9g s must be a multiple of the sampling interval of %.9g s", length,
            1 / rate);
    count = (long)(wanted + 0.5);
    whole = wanted - (double)count;
    if (whole > NEAR || whole < -NEAR)
        return say(own, fmi3Error, "the step of %.9g s is not a multiple of the sampling interval of %.9g s", length,
            1 / rate);
    while (count-- > 0)
        step(&own->now);
    own->now.time = time + length;
    *last = own->now.time;
    for (i = 0; i < OUTPUTS; ++i) {
        if (!(own->now.outputs[i] - own->now.outputs[i] == 0))
            return say(own, fmi3Error, "the output is not finite at %.9g s: the model diverges", own->now.time);
    }
    if (own->now.state.faults & ${NAME}_NOT_FINITE) {
        own->now.state.faults = 0;
        return say(own, fmi3Warning, "an input was not finite at %.9g s; $held", time);
    }
    return fmi3OK;
}

EXPORTED fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    return say(instance, fmi3Error, "this FMU has no events");
}

EXPORTED fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    return say(instance, fmi3Error, "this FMU has no events");
}

/* Value references: 0 is the time, then come the inputs, then the outputs. */
EXPORTED fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
    double values[], size_t size)
{
    Instance *own = instance;
    size_t i;
    if (size != count)
        return say(own, fmi3Error, "%lu values for %lu variables", (unsigned long)size, (unsigned long)count);
    if (own->now.mode == INITIALIZING)
        look(&own->now);
    for (i = 0; i < count; ++i) {
        const fmi3ValueReference own_reference = references[i];
        if (own_reference == 0)
            values[i] = own->now.time;
        else if (own_reference <= INPUTS)
            values[i] = own->now.inputs[own_reference - 1];
        else if (own_reference <= INPUTS + OUTPUTS)
            values[i] = own->now.outputs[own_reference - 1 - INPUTS];
        else
            return say(own, fmi3Error, "there is no variable of reference %lu", (unsigned long)own_reference);
    }
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
    const double values[], size_t size)
{
    Instance *own = instance;
    size_t i;
    if (size != count)
        return say(own, fmi3Error, "%lu values for %lu variables", (unsigned long)size, (unsigned long)count);
    for (i = 0; i < count; ++i) {
        if (references[i] < 1 || references[i] > INPUTS)
            return say(own, fmi3Error, "the variable of reference %lu is no input", (unsigned long)references[i]);
        own->now.inputs[references[i] - 1] = values[i];
    }
    return fmi3OK;
}

EXPORTED fmi3Status fmi3GetFMUState(fmi3Instance instance, void **saved)
{
    Values *copy = *saved ? *saved : malloc(sizeof *copy);
    if (!copy)
        return say(instance, fmi3Error, "there is no memory for the state");
    *copy = ((Instance *)instance)->now;
    *saved = copy;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SetFMUState(fmi3Instance instance, void *saved)
{
    ((Instance *)instance)->now = *(const Values *)saved;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3FreeFMUState(fmi3Instance instance, void **saved)
{
    (void)instance;
    free(*saved);
    *saved = NULL;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, void *saved, size_t *size)
{
    (void)instance, (void)saved;
    *size = sizeof(Values);
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SerializeFMUState(fmi3Instance instance, void *saved, uint8_t bytes[], size_t size)
{
    if (size != sizeof(Values))
        return say(instance, fmi3Error, "the state has %lu bytes", (unsigned long)sizeof(Values));
    memcpy(bytes, saved, size);
    return fmi3OK;
}

EXPORTED fmi3Status fmi3DeserializeFMUState(
    fmi3Instance instance, const uint8_t bytes[], size_t size, void **saved)
{
    Values *copy = *saved ? *saved : malloc(sizeof *copy);
    if (size != sizeof(Values) || !copy) {
        if (copy != *saved)
            free(copy);
        return say(instance, fmi3Error, "the state has %lu bytes", (unsigned long)sizeof(Values));
    }
    memcpy(copy, bytes, size);
    *saved = copy;
    return fmi3OK;
}

$absent