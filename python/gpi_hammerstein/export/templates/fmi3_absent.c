/* FMI demands that all functions are there. These are for variables, interfaces and features that modelDescription.xml does
   not list, so that no simulator calls them. */
static fmi3Status absent(fmi3Instance instance, const char *what)
{
    return say(instance, fmi3Error, "this FMU has no %s", what);
}

#define VARIABLES(type, c_type)                                                                               \
    EXPORTED fmi3Status fmi3Get##type(                                                                        \
        fmi3Instance instance, const fmi3ValueReference r[], size_t n, c_type v[], size_t size)               \
    {                                                                                                         \
        (void)r, (void)v, (void)size;                                                                         \
        return n ? absent(instance, "variable of type " #type) : fmi3OK;                                      \
    }                                                                                                         \
    EXPORTED fmi3Status fmi3Set##type(                                                                        \
        fmi3Instance instance, const fmi3ValueReference r[], size_t n, const c_type v[], size_t size)         \
    {                                                                                                         \
        (void)r, (void)v, (void)size;                                                                         \
        return n ? absent(instance, "variable of type " #type) : fmi3OK;                                      \
    }

VARIABLES(Float32, float)
VARIABLES(Int8, int8_t)
VARIABLES(UInt8, uint8_t)
VARIABLES(Int16, int16_t)
VARIABLES(UInt16, uint16_t)
VARIABLES(Int32, int32_t)
VARIABLES(UInt32, uint32_t)
VARIABLES(Int64, int64_t)
VARIABLES(UInt64, uint64_t)
VARIABLES(Boolean, bool)
VARIABLES(String, fmi3String)

/* The rest has arguments that are not read. */
#define ABSENT(function, arguments, what)                                                                     \
    EXPORTED fmi3Status function arguments;                                                                   \
    EXPORTED fmi3Status function arguments                                                                    \
    {                                                                                                         \
        return absent(i, what);                                                                               \
    }
#define REFERENCES fmi3Instance i, const fmi3ValueReference r[], size_t n

#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

ABSENT(fmi3GetBinary, (REFERENCES, size_t s[], const uint8_t *v[], size_t m), "binary variable")
ABSENT(fmi3SetBinary, (REFERENCES, const size_t s[], const uint8_t *const v[], size_t m), "binary variable")
ABSENT(fmi3GetClock, (REFERENCES, bool v[]), "clock")
ABSENT(fmi3SetClock, (REFERENCES, const bool v[]), "clock")
ABSENT(fmi3GetIntervalDecimal, (REFERENCES, double v[], int q[]), "clock")
ABSENT(fmi3GetIntervalFraction, (REFERENCES, uint64_t c[], uint64_t v[], int q[]), "clock")
ABSENT(fmi3GetShiftDecimal, (REFERENCES, double v[]), "clock")
ABSENT(fmi3GetShiftFraction, (REFERENCES, uint64_t c[], uint64_t v[]), "clock")
ABSENT(fmi3SetIntervalDecimal, (REFERENCES, const double v[]), "clock")
ABSENT(fmi3SetIntervalFraction, (REFERENCES, const uint64_t c[], const uint64_t v[]), "clock")
ABSENT(fmi3SetShiftDecimal, (REFERENCES, const double v[]), "clock")
ABSENT(fmi3SetShiftFraction, (REFERENCES, const uint64_t c[], const uint64_t v[]), "clock")
ABSENT(fmi3GetNumberOfVariableDependencies, (fmi3Instance i, fmi3ValueReference r, size_t *n), "list of dependencies")
ABSENT(fmi3GetVariableDependencies,
    (fmi3Instance i, fmi3ValueReference r, size_t e[], fmi3ValueReference d[], size_t f[], int k[], size_t n),
    "list of dependencies")
ABSENT(fmi3GetDirectionalDerivative,
    (REFERENCES, const fmi3ValueReference k[], size_t m, const double s[], size_t p, double v[], size_t q),
    "derivatives")
ABSENT(fmi3GetAdjointDerivative,
    (REFERENCES, const fmi3ValueReference k[], size_t m, const double s[], size_t p, double v[], size_t q),
    "derivatives")
ABSENT(fmi3GetOutputDerivatives, (REFERENCES, const int32_t o[], double v[], size_t m), "derivatives of outputs")
ABSENT(fmi3EnterConfigurationMode, (fmi3Instance i), "structural parameters")
ABSENT(fmi3ExitConfigurationMode, (fmi3Instance i), "structural parameters")
ABSENT(fmi3EvaluateDiscreteStates, (fmi3Instance i), "events")
ABSENT(fmi3UpdateDiscreteStates,
    (fmi3Instance i, bool *a, bool *b, bool *c, bool *d, bool *e, double *t), "events")
ABSENT(fmi3EnterContinuousTimeMode, (fmi3Instance i), "interface for model exchange")
ABSENT(fmi3CompletedIntegratorStep, (fmi3Instance i, bool n, bool *e, bool *t), "interface for model exchange")
ABSENT(fmi3SetTime, (fmi3Instance i, double t), "interface for model exchange")
ABSENT(fmi3SetContinuousStates, (fmi3Instance i, const double x[], size_t n), "interface for model exchange")
ABSENT(fmi3GetContinuousStateDerivatives, (fmi3Instance i, double x[], size_t n), "interface for model exchange")
ABSENT(fmi3GetEventIndicators, (fmi3Instance i, double x[], size_t n), "interface for model exchange")
ABSENT(fmi3GetContinuousStates, (fmi3Instance i, double x[], size_t n), "interface for model exchange")
ABSENT(fmi3GetNominalsOfContinuousStates, (fmi3Instance i, double x[], size_t n), "interface for model exchange")
ABSENT(fmi3GetNumberOfEventIndicators, (fmi3Instance i, size_t *n), "interface for model exchange")
ABSENT(fmi3GetNumberOfContinuousStates, (fmi3Instance i, size_t *n), "interface for model exchange")
ABSENT(fmi3ActivateModelPartition, (fmi3Instance i, fmi3ValueReference c, double t), "scheduled execution")

EXPORTED fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
    bool visible, bool logging, void *environment, Log log)
{
    return NULL;
}

EXPORTED fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
    bool visible, bool logging, void *environment, Log log, void *update, void *lock, void *unlock)
{
    return NULL;
}
