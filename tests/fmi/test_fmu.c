/* A test FMU for co-simulation, for FMI 2.0 or 3.0 (FMI_VERSION): proportional-derivative control of six joints, and a
   damper on the base, like examples/controllers/own_pd.c. Its outputs are zero until its first step. "does"
   selects its error: "nothing", "refuses", "checks", "discards", "fails", "nan", "crashes"; "passes": its first effort
   is the input "unused". References: 0 + j
   position, 20 + j rate, 40 + j desired position, 60 + j desired rate, 80 + k angular velocity of the base, 100 + j
   effort, 120 + k torque on the base; 200 kp, 201 kd, 202 base_kd; 203 whole; 204 on; 205 does; inputs of FMUs that
   have them: 210 unused, 211 switched, 212 counted, 213 called, which it "checks". */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define EXPORT __attribute__((visibility("default")))
#ifndef TEST_VERSION_TEXT
#if FMI_VERSION == 2
#define TEST_VERSION_TEXT "2.0"
#else
#define TEST_VERSION_TEXT "3.0"
#endif
#endif

typedef struct {
  double value[300], time;
  int whole, initialized;
  bool on, switched;
  int counted;
  char does[32], called[32];
  void* environment;
#if FMI_VERSION == 2
  void (*log)(void*, const char*, int, const char*, const char*, ...);
#else
  void (*log)(void*, int, const char*, const char*);
#endif
} model;

static int alive = 0; /* instances in this process */

static void log_error(model* m, const char* text) {
#if FMI_VERSION == 2
  m->log(m->environment, "it", 3, "error", "%s", text);
#else
  m->log(m->environment, 3, "error", text);
#endif
}

static int step(model* m, double time, double length) {
  int j;
  if (!m->initialized || fabs(m->time - time) > 1e-9) {
    log_error(m, "stepped from another time than the one it is at");
    return 3;
  }
  m->time = time + length;
  if (!strcmp(m->does, "discards")) return 2;
  if (!strcmp(m->does, "fails")) {
    log_error(m, "the sun is out");
    return 3;
  }
  if (!strcmp(m->does, "crashes")) *(volatile int*)(size_t)8 = 1;
  for (j = 0; j < 6; ++j) {
    m->value[100 + j] =
        m->value[200] * (m->value[40 + j] - m->value[j]) + m->value[201] * (m->value[60 + j] - m->value[20 + j]);
  }
  for (j = 0; j < 3; ++j) m->value[120 + j] = -m->value[202] * m->value[80 + j];
  if (!strcmp(m->does, "passes")) m->value[100] = m->value[210];
  if (!strcmp(m->does, "nan")) m->value[103] = NAN;
  return 0;
}

static int get(model* m, const unsigned* r, size_t n, double* v) {
  size_t i;
  for (i = 0; i < n; ++i) v[i] = m->value[r[i]];
  return 0;
}
static int set(model* m, const unsigned* r, size_t n, const double* v) {
  size_t i;
  for (i = 0; i < n; ++i) m->value[r[i]] = v[i];
  return 0;
}
static int set_text(model* m, unsigned r, const char* text) {
  strncpy(r == 213 ? m->called : m->does, text, sizeof(m->does) - 1);
  return 0;
}
static int set_whole(model* m, unsigned r, int value) {
  *(r == 212 ? &m->counted : &m->whole) = value;
  return 0;
}
static int set_flag(model* m, unsigned r, bool value) {
  *(r == 211 ? &m->switched : &m->on) = value;
  return 0;
}
static int enter(model* m, double start) {
  m->time = start;
  if (strcmp(m->does, "refuses")) return 0;
  log_error(m, m->on && m->whole == 7 ? "refused, as it was asked to" : "its parameters are wrong");
  return 3;
}
static int leave(model* m) {
  if (!strcmp(m->does, "checks") &&
      !(m->value[210] == 7.5 && m->switched && m->counted == 3 && !strcmp(m->called, "fine"))) {
    log_error(m, "its inputs are not as they should be");
    return 3;
  }
  m->initialized = 1;
  return 0;
}

#if FMI_VERSION == 2
typedef struct {
  void (*log)(void*, const char*, int, const char*, const char*, ...);
  void* (*allocate)(size_t, size_t);
  void (*release)(void*);
  void (*finished)(void*, int);
  void* environment;
} callbacks;
EXPORT const char* fmi2GetVersion(void) { return TEST_VERSION_TEXT; }
EXPORT void* fmi2Instantiate(const char* name, int type, const char* guid, const char* resources, const callbacks* c,
                             int visible, int logging) {
  model* m;
  (void)name, (void)visible, (void)logging;
  if (type != 1 || strcmp(guid, "{test}") || strncmp(resources, "file:///", 8)) return NULL;
  if (ONCE && alive) return NULL;
  m = c->allocate(1, sizeof(model));
  m->log = c->log, m->environment = c->environment;
  ++alive;
  return m;
}
EXPORT void fmi2FreeInstance(void* m) {
  --alive;
  free(m);
}
EXPORT int fmi2SetupExperiment(void* m, int t, double tol, double start, int s, double stop) {
  (void)t, (void)tol, (void)s, (void)stop;
  return enter(m, start);
}
EXPORT int fmi2EnterInitializationMode(void* m) { return (void)m, 0; }
EXPORT int fmi2ExitInitializationMode(void* m) { return leave(m); }
EXPORT int fmi2Terminate(void* m) { return (void)m, 0; }
EXPORT int fmi2GetReal(void* m, const unsigned* r, size_t n, double* v) { return get(m, r, n, v); }
EXPORT int fmi2SetReal(void* m, const unsigned* r, size_t n, const double* v) { return set(m, r, n, v); }
EXPORT int fmi2SetInteger(void* m, const unsigned* r, size_t n, const int* v) {
  return (void)n, set_whole(m, r[0], v[0]);
}
EXPORT int fmi2SetBoolean(void* m, const unsigned* r, size_t n, const int* v) {
  return (void)n, set_flag(m, r[0], v[0] != 0);
}
EXPORT int fmi2SetString(void* m, const unsigned* r, size_t n, const char* const* v) {
  return (void)n, set_text(m, r[0], v[0]);
}
#ifdef TEST_NO_STEP
#define fmi2DoStep of_another_name
#endif
EXPORT int fmi2DoStep(void* m, double t, double h, int no_return) { return (void)no_return, step(m, t, h); }
#else
EXPORT const char* fmi3GetVersion(void) { return TEST_VERSION_TEXT; }
EXPORT void* fmi3InstantiateCoSimulation(const char* name, const char* token, const char* resources, bool visible,
                                         bool logging, bool events, bool early, const unsigned* required, size_t count,
                                         void* environment, void (*log)(void*, int, const char*, const char*),
                                         void* intermediate) {
  model* m;
  (void)name, (void)visible, (void)logging, (void)required;
  if (strcmp(token, "{test}") || resources[0] != '/' || resources[strlen(resources) - 1] != '/') return NULL;
  if (events || early || count || intermediate) return NULL;
  m = calloc(1, sizeof(model));
  m->log = log, m->environment = environment;
  ++alive;
  return m;
}
EXPORT void fmi3FreeInstance(void* m) {
  --alive;
  free(m);
}
EXPORT int fmi3EnterInitializationMode(void* m, bool t, double tol, double start, bool s, double stop) {
  (void)t, (void)tol, (void)s, (void)stop;
  return enter(m, start);
}
EXPORT int fmi3ExitInitializationMode(void* m) { return leave(m); }
EXPORT int fmi3Terminate(void* m) { return (void)m, 0; }
EXPORT int fmi3Reset(void* m) { return (void)m, 0; }
EXPORT int fmi3GetFloat64(void* m, const unsigned* r, size_t n, double* v, size_t nv) {
  return n == nv ? get(m, r, n, v) : 3;
}
EXPORT int fmi3SetFloat64(void* m, const unsigned* r, size_t n, const double* v, size_t nv) {
  return n == nv ? set(m, r, n, v) : 3;
}
EXPORT int fmi3SetInt32(void* m, const unsigned* r, size_t n, const int32_t* v, size_t nv) {
  return (void)n, (void)nv, set_whole(m, r[0], v[0]);
}
EXPORT int fmi3SetBoolean(void* m, const unsigned* r, size_t n, const bool* v, size_t nv) {
  return (void)n, (void)nv, set_flag(m, r[0], v[0]);
}
EXPORT int fmi3SetString(void* m, const unsigned* r, size_t n, const char* const* v, size_t nv) {
  return (void)n, (void)nv, set_text(m, r[0], v[0]);
}
EXPORT int fmi3DoStep(void* m, double t, double h, bool no_return, bool* event, bool* ends, bool* early, double* last) {
  (void)no_return;
  *event = *ends = *early = false, *last = t + h;
  return step(m, t, h);
}
#endif
