/* The shared library of a laboratory's FMU (FMI 3.0, co-simulation). It starts the program that emulates the laboratory, and
   passes commands and measurements through the program's standard input and output.

   INPUTS, OUTPUTS, INTERVAL (s), TOKEN and SEED_START are given to the compiler. The value references are 0 for time, 1 for
   the seed, 10 and following for inputs, 100 and following for outputs.

   The file `command` in the resources holds the program and its arguments, one per line; the folder of the resources is
   added as the last argument. If RTHS_FMU_PYTHON is set, it replaces the program.

   The program is sent 'S' and the seed once, then 'C' and the commands at every interval. It answers with a zero and the
   measurements (float64), or with a one, a length of two bytes and an error message. */

#include <math.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define API __attribute__((visibility("default")))
enum { OK, WARNING, DISCARD, ERROR, FATAL };
enum { TIME = 0, SEED = 1, FIRST_INPUT = 10, FIRST_OUTPUT = 100, MOST_WORDS = 32 };

typedef void (*Log)(void *environment, int status, const char *category, const char *message);

typedef struct {
    char *resources, *text, *words[MOST_WORDS + 2];
    void *environment;
    Log log;
    pid_t child;
    int to, from;
    bool started;
    int64_t seed;
    double time, inputs[INPUTS], outputs[OUTPUTS];
} Laboratory;

static int failed(Laboratory *lab, const char *why)
{
    if (lab->log)
        lab->log(lab->environment, ERROR, "error", why);
    return ERROR;
}

static int whole(int file, void *bytes, size_t count, bool writes)
{
    for (char *at = bytes; count;) {
        ssize_t done = writes ? write(file, at, count) : read(file, at, count);
        if (done <= 0)
            return 0;
        at += done;
        count -= done;
    }
    return 1;
}

static int answered(Laboratory *lab)
{
    unsigned char head, size[2];
    char text[512];
    if (!whole(lab->from, &head, 1, false))
        return failed(lab, "The laboratory's program has ended: see what it wrote to standard error.");
    if (head == 0)
        return whole(lab->from, lab->outputs, sizeof lab->outputs, false) ? OK : failed(lab, "The laboratory's program has ended.");
    if (!whole(lab->from, size, 2, false))
        return failed(lab, "The laboratory's program has ended.");
    size_t length = size[0] + 256 * size[1];
    length = length < sizeof text - 1 ? length : sizeof text - 1;
    text[whole(lab->from, text, length, false) ? length : 0] = 0;
    return failed(lab, text);
}

static int begin(Laboratory *lab)
{
    int to[2], from[2];
    if (pipe(to) || pipe(from))
        return failed(lab, "No pipe to the laboratory's program can be opened.");
    lab->child = fork();
    if (lab->child == 0) {
        dup2(to[0], 0);
        dup2(from[1], 1);
        for (int file = 3; file < 1024; file++)
            close(file);
        execvp(lab->words[0], lab->words);
        _exit(127);
    }
    close(to[0]);
    close(from[1]);
    lab->to = to[1];
    lab->from = from[0];
    lab->started = lab->child > 0;
    signal(SIGPIPE, SIG_IGN);
    char order = 'S';
    if (!lab->started || !whole(lab->to, &order, 1, true) || !whole(lab->to, &lab->seed, 8, true))
        return failed(lab, "The laboratory's program cannot be started.");
    return answered(lab);
}

static void end(Laboratory *lab)
{
    if (!lab->started)
        return;
    lab->started = false;
    close(lab->to);                                               /* the program disarms and ends */
    close(lab->from);
    waitpid(lab->child, NULL, 0);
}

/* ---- the functions of FMI 3.0 ------------------------------------------------------------------------------------- */

API const char *fmi3GetVersion(void) { return "3.0"; }

API int fmi3SetDebugLogging(void *it, bool on, size_t count, const char *const *names)
{
    (void)it, (void)on, (void)count, (void)names;
    return OK;
}

API void fmi3FreeInstance(void *it)
{
    Laboratory *lab = it;
    if (lab == NULL)
        return;
    end(lab);
    free(lab->text);
    free(lab->resources);
    free(lab);
}

API void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
    bool events, bool early, const uint32_t *needed, size_t count, void *environment, Log log, void *intermediate)
{
    (void)name, (void)visible, (void)logging, (void)events, (void)early, (void)needed, (void)count, (void)intermediate;
    if (strcmp(token, TOKEN) || resources == NULL)
        return NULL;
    Laboratory *lab = calloc(1, sizeof *lab);
    lab->environment = environment;
    lab->log = log;
    lab->seed = SEED_START;
    lab->resources = strdup(resources);
    char path[4096];
    snprintf(path, sizeof path, "%s/command", resources);
    FILE *file = fopen(path, "r");
    lab->text = calloc(1, 8192);
    size_t size = file ? fread(lab->text, 1, 8191, file) : 0;
    if (file)
        fclose(file);
    int words = 0;
    for (char *word = strtok(lab->text, "\n"); word && words < MOST_WORDS; word = strtok(NULL, "\n"))
        lab->words[words++] = word;
    if (!size || !words) {
        failed(lab, "The FMU's resources hold no file 'command'.");
        fmi3FreeInstance(lab);
        return NULL;
    }
    if (getenv("RTHS_FMU_PYTHON"))
        lab->words[0] = getenv("RTHS_FMU_PYTHON");
    lab->words[words] = lab->resources;
    return lab;
}

API int fmi3EnterInitializationMode(void *it, bool defined, double tolerance, double start, bool ends, double stop)
{
    (void)defined, (void)tolerance, (void)ends, (void)stop;
    Laboratory *lab = it;
    lab->time = start;
    return lab->started ? OK : begin(lab);
}

API int fmi3ExitInitializationMode(void *it) { (void)it; return OK; }

API int fmi3Terminate(void *it)
{
    end(it);
    return OK;
}

API int fmi3Reset(void *it)
{
    Laboratory *lab = it;
    end(lab);
    lab->seed = SEED_START;
    memset(lab->inputs, 0, sizeof lab->inputs);
    memset(lab->outputs, 0, sizeof lab->outputs);
    return OK;
}

API int fmi3DoStep(void *it, double now, double step, bool final, bool *event, bool *terminate, bool *early, double *last)
{
    (void)final;
    Laboratory *lab = it;
    double intervals = round(step / INTERVAL);
    *event = *terminate = *early = false;
    *last = now;
    if (intervals < 1.0 || fabs(step / INTERVAL - intervals) > 1e-6 * intervals)
        return failed(lab, "The communication step is no multiple of the laboratory's interval.");
    for (; intervals >= 1.0; intervals -= 1.0) {
        char order = 'C';
        if (!lab->started || !whole(lab->to, &order, 1, true) || !whole(lab->to, lab->inputs, sizeof lab->inputs, true))
            return failed(lab, "The laboratory's program has ended.");
        if (answered(lab) != OK)
            return ERROR;
    }
    *last = lab->time = now + step;
    return OK;
}

API int fmi3GetFloat64(void *it, const uint32_t *references, size_t count, double *values, size_t size)
{
    Laboratory *lab = it;
    (void)size;
    for (size_t i = 0; i < count; i++) {
        uint32_t at = references[i];
        if (at == TIME)
            values[i] = lab->time;
        else if (at >= FIRST_INPUT && at < FIRST_INPUT + INPUTS)
            values[i] = lab->inputs[at - FIRST_INPUT];
        else if (at >= FIRST_OUTPUT && at < FIRST_OUTPUT + OUTPUTS)
            values[i] = lab->outputs[at - FIRST_OUTPUT];
        else
            return failed(lab, "There is no such number.");
    }
    return OK;
}

API int fmi3SetFloat64(void *it, const uint32_t *references, size_t count, const double *values, size_t size)
{
    Laboratory *lab = it;
    (void)size;
    for (size_t i = 0; i < count; i++) {
        if (references[i] < FIRST_INPUT || references[i] >= FIRST_INPUT + INPUTS)
            return failed(lab, "Only inputs can be set.");
        lab->inputs[references[i] - FIRST_INPUT] = values[i];
    }
    return OK;
}

API int fmi3GetInt64(void *it, const uint32_t *references, size_t count, int64_t *values, size_t size)
{
    (void)size;
    for (size_t i = 0; i < count; i++) {
        if (references[i] != SEED)
            return failed(it, "There is no such number.");
        values[i] = ((Laboratory *)it)->seed;
    }
    return OK;
}

API int fmi3SetInt64(void *it, const uint32_t *references, size_t count, const int64_t *values, size_t size)
{
    Laboratory *lab = it;
    (void)size;
    for (size_t i = 0; i < count; i++) {
        if (references[i] != SEED || lab->started || values[i] < 0)
            return failed(lab, "The seed must be at least 0, and must be set before the initialization.");
        lab->seed = values[i];
    }
    return OK;
}

/* Functions of capabilities that the model description denies, and of types that no variable has. */
#define CANNOT(name) API int name(void *it) { return failed(it, #name " is not provided."); }
#define NONE(name) API int name(void *it, const uint32_t *references, size_t count) \
    { (void)references; return count ? failed(it, #name ": there is no variable of that type.") : OK; }
API void *fmi3InstantiateModelExchange(void) { return NULL; }
API void *fmi3InstantiateScheduledExecution(void) { return NULL; }
NONE(fmi3GetFloat32) NONE(fmi3GetInt8) NONE(fmi3GetUInt8) NONE(fmi3GetInt16) NONE(fmi3GetUInt16) NONE(fmi3GetInt32)
NONE(fmi3GetUInt32) NONE(fmi3GetUInt64) NONE(fmi3GetBoolean) NONE(fmi3GetString) NONE(fmi3GetBinary) NONE(fmi3GetClock)
NONE(fmi3SetFloat32) NONE(fmi3SetInt8) NONE(fmi3SetUInt8) NONE(fmi3SetInt16) NONE(fmi3SetUInt16) NONE(fmi3SetInt32)
NONE(fmi3SetUInt32) NONE(fmi3SetUInt64) NONE(fmi3SetBoolean) NONE(fmi3SetString) NONE(fmi3SetBinary) NONE(fmi3SetClock)
CANNOT(fmi3EnterEventMode) CANNOT(fmi3GetNumberOfVariableDependencies) CANNOT(fmi3GetVariableDependencies)
CANNOT(fmi3GetFMUState) CANNOT(fmi3SetFMUState) CANNOT(fmi3FreeFMUState) CANNOT(fmi3SerializedFMUStateSize)
CANNOT(fmi3SerializeFMUState) CANNOT(fmi3DeserializeFMUState) CANNOT(fmi3GetDirectionalDerivative)
CANNOT(fmi3GetAdjointDerivative) CANNOT(fmi3EnterConfigurationMode) CANNOT(fmi3ExitConfigurationMode)
CANNOT(fmi3GetIntervalDecimal) CANNOT(fmi3GetIntervalFraction) CANNOT(fmi3GetShiftDecimal) CANNOT(fmi3GetShiftFraction)
CANNOT(fmi3SetIntervalDecimal) CANNOT(fmi3SetIntervalFraction) CANNOT(fmi3SetShiftDecimal) CANNOT(fmi3SetShiftFraction)
CANNOT(fmi3EvaluateDiscreteStates) CANNOT(fmi3UpdateDiscreteStates) CANNOT(fmi3EnterContinuousTimeMode)
CANNOT(fmi3CompletedIntegratorStep) CANNOT(fmi3SetTime) CANNOT(fmi3SetContinuousStates)
CANNOT(fmi3GetContinuousStateDerivatives) CANNOT(fmi3GetEventIndicators) CANNOT(fmi3GetContinuousStates)
CANNOT(fmi3GetNominalsOfContinuousStates) CANNOT(fmi3GetNumberOfEventIndicators)
CANNOT(fmi3GetNumberOfContinuousStates) CANNOT(fmi3EnterStepMode) CANNOT(fmi3GetOutputDerivatives)
CANNOT(fmi3ActivateModelPartition)
