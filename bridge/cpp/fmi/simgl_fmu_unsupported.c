/* The functions of FMI 3.0 that this FMU does not offer: it has no other types of variables than
 * simgl_fmu.c reads and writes, no clocks, no events, no states to keep and no derivatives. */
#include "fmi3Functions.h"

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define UNSUPPORTED(name, ...) \
    fmi3Status name(__VA_ARGS__) { return fmi3Error; }

UNSUPPORTED(fmi3EnterEventMode, fmi3Instance instance)
UNSUPPORTED(fmi3GetFloat32, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Float32 values[], size_t nValues)
UNSUPPORTED(fmi3GetInt8, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, fmi3Int8 values[], size_t nValues)
UNSUPPORTED(fmi3GetUInt8, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, fmi3UInt8 values[], size_t nValues)
UNSUPPORTED(fmi3GetInt16, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, fmi3Int16 values[], size_t nValues)
UNSUPPORTED(fmi3GetInt32, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, fmi3Int32 values[], size_t nValues)
UNSUPPORTED(fmi3GetUInt32, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, fmi3UInt32 values[], size_t nValues)
UNSUPPORTED(fmi3GetUInt64, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, fmi3UInt64 values[], size_t nValues)
UNSUPPORTED(fmi3GetClock, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, fmi3Clock values[])
UNSUPPORTED(fmi3SetFloat32, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Float32 values[], size_t nValues)
UNSUPPORTED(fmi3SetInt8, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, const fmi3Int8 values[], size_t nValues)
UNSUPPORTED(fmi3SetUInt8, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, const fmi3UInt8 values[], size_t nValues)
UNSUPPORTED(fmi3SetInt16, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, const fmi3Int16 values[], size_t nValues)
UNSUPPORTED(fmi3SetUInt16, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, const fmi3UInt16 values[], size_t nValues)
UNSUPPORTED(fmi3SetInt32, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, const fmi3Int32 values[], size_t nValues)
UNSUPPORTED(fmi3SetUInt32, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, const fmi3UInt32 values[], size_t nValues)
UNSUPPORTED(fmi3SetUInt64, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, const fmi3UInt64 values[], size_t nValues)
UNSUPPORTED(fmi3SetBinary, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
UNSUPPORTED(fmi3SetClock, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t
    nValueReferences, const fmi3Clock values[])
UNSUPPORTED(fmi3GetNumberOfVariableDependencies, fmi3Instance instance, fmi3ValueReference
    valueReference, size_t* nDependencies)
UNSUPPORTED(fmi3GetVariableDependencies, fmi3Instance instance, fmi3ValueReference dependent, size_t
    elementIndicesOfDependent[], fmi3ValueReference independents[], size_t
    elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[], size_t nDependencies)
UNSUPPORTED(fmi3GetFMUState, fmi3Instance instance, fmi3FMUState* FMUState)
UNSUPPORTED(fmi3SetFMUState, fmi3Instance instance, fmi3FMUState FMUState)
UNSUPPORTED(fmi3FreeFMUState, fmi3Instance instance, fmi3FMUState* FMUState)
UNSUPPORTED(fmi3SerializedFMUStateSize, fmi3Instance instance, fmi3FMUState FMUState, size_t* size)
UNSUPPORTED(fmi3SerializeFMUState, fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte
    serializedState[], size_t size)
UNSUPPORTED(fmi3DeserializeFMUState, fmi3Instance instance, const fmi3Byte serializedState[], size_t
    size, fmi3FMUState* FMUState)
UNSUPPORTED(fmi3GetDirectionalDerivative, fmi3Instance instance, const fmi3ValueReference
    unknowns[], size_t nUnknowns, const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64
    seed[], size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
UNSUPPORTED(fmi3GetAdjointDerivative, fmi3Instance instance, const fmi3ValueReference unknowns[],
    size_t nUnknowns, const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
UNSUPPORTED(fmi3EnterConfigurationMode, fmi3Instance instance)
UNSUPPORTED(fmi3ExitConfigurationMode, fmi3Instance instance)
UNSUPPORTED(fmi3GetIntervalDecimal, fmi3Instance instance, const fmi3ValueReference
    valueReferences[], size_t nValueReferences, fmi3Float64 intervals[], fmi3IntervalQualifier
    qualifiers[])
UNSUPPORTED(fmi3GetIntervalFraction, fmi3Instance instance, const fmi3ValueReference
    valueReferences[], size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
    fmi3IntervalQualifier qualifiers[])
UNSUPPORTED(fmi3GetShiftDecimal, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Float64 shifts[])
UNSUPPORTED(fmi3GetShiftFraction, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
UNSUPPORTED(fmi3SetIntervalDecimal, fmi3Instance instance, const fmi3ValueReference
    valueReferences[], size_t nValueReferences, const fmi3Float64 intervals[])
UNSUPPORTED(fmi3SetIntervalFraction, fmi3Instance instance, const fmi3ValueReference
    valueReferences[], size_t nValueReferences, const fmi3UInt64 counters[], const fmi3UInt64
    resolutions[])
UNSUPPORTED(fmi3SetShiftDecimal, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Float64 shifts[])
UNSUPPORTED(fmi3SetShiftFraction, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
UNSUPPORTED(fmi3EvaluateDiscreteStates, fmi3Instance instance)
UNSUPPORTED(fmi3UpdateDiscreteStates, fmi3Instance instance, fmi3Boolean* discreteStatesNeedUpdate,
    fmi3Boolean* terminateSimulation, fmi3Boolean* nominalsOfContinuousStatesChanged, fmi3Boolean*
    valuesOfContinuousStatesChanged, fmi3Boolean* nextEventTimeDefined, fmi3Float64* nextEventTime)
UNSUPPORTED(fmi3EnterContinuousTimeMode, fmi3Instance instance)
UNSUPPORTED(fmi3CompletedIntegratorStep, fmi3Instance instance, fmi3Boolean
    noSetFMUStatePriorToCurrentPoint, fmi3Boolean* enterEventMode, fmi3Boolean* terminateSimulation)
UNSUPPORTED(fmi3SetTime, fmi3Instance instance, fmi3Float64 time)
UNSUPPORTED(fmi3SetContinuousStates, fmi3Instance instance, const fmi3Float64 continuousStates[],
    size_t nContinuousStates)
UNSUPPORTED(fmi3GetContinuousStateDerivatives, fmi3Instance instance, fmi3Float64 derivatives[],
    size_t nContinuousStates)
UNSUPPORTED(fmi3GetEventIndicators, fmi3Instance instance, fmi3Float64 eventIndicators[], size_t
    nEventIndicators)
UNSUPPORTED(fmi3GetContinuousStates, fmi3Instance instance, fmi3Float64 continuousStates[], size_t
    nContinuousStates)
UNSUPPORTED(fmi3GetNominalsOfContinuousStates, fmi3Instance instance, fmi3Float64 nominals[], size_t
    nContinuousStates)
UNSUPPORTED(fmi3GetNumberOfEventIndicators, fmi3Instance instance, size_t* nEventIndicators)
UNSUPPORTED(fmi3GetNumberOfContinuousStates, fmi3Instance instance, size_t* nContinuousStates)
UNSUPPORTED(fmi3EnterStepMode, fmi3Instance instance)
UNSUPPORTED(fmi3GetOutputDerivatives, fmi3Instance instance, const fmi3ValueReference
    valueReferences[], size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[], size_t
    nValues)
UNSUPPORTED(fmi3ActivateModelPartition, fmi3Instance instance, fmi3ValueReference clockReference,
    fmi3Float64 activationTime)

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible,
                                          fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
    fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback unlockPreemption) {
    return NULL;
}
