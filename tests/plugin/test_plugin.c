/* A plugin whose parameters select its behaviour: {"does": "nothing"}, "refuses", "fails", "nan", "crashes", "aborts",
   and "asks": it writes the results of its model queries to a file, {"file": PATH}. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "grapnel/plugin/grapnel_controller.h"

#ifndef TEST_VERSION
#define TEST_VERSION GRAPNEL_CONTROLLER_VERSION
#endif

typedef struct {
  char does[32], file[512];
  double sum; /* of joint positions received: its internal state */
} instance;

static void text_at(const char* json, const char* key, char* text, size_t size) {
  const char* at = strstr(json, key);
  size_t n = 0;
  text[0] = 0;
  if (!at) return;
  at += strlen(key);
  while (at[n] && at[n] != '"' && n + 1 < size) ++n;
  memcpy(text, at, n);
  text[n] = 0;
}

static int create(const grapnel_controller_setup* setup, void** made, char* error, size_t error_size) {
  instance* own = calloc(1, sizeof(instance));
  text_at(setup->parameters, "\"does\":\"", own->does, sizeof(own->does));
  text_at(setup->parameters, "\"file\":\"", own->file, sizeof(own->file));
  if (!strcmp(own->does, "refuses")) {
    snprintf(error, error_size, "not with %d joints every %g s", setup->joints, setup->period);
    free(own);
    return 1;
  }
  if (!strcmp(own->does, "asks")) {
    FILE* f = fopen(own->file, "w");
    fprintf(f, "%s\n", setup->model);
    fclose(f);
  }
  *made = own;
  return 0;
}

static int reset(void* made, double time) {
  (void)time;
  ((instance*)made)->sum = 0;
  return 0;
}

static void query(const instance* own, const grapnel_controller_input* in, const grapnel_controller_access* access) {
  double H[256], C[16], p[6], J[6 * 16];
  const void* c = access->context;
  const int n = access->velocities(c), m = n - 6;
  int i;
  FILE* f = fopen(own->file, "a");
  access->mass_matrix(c, H);
  access->bias(c, C);
  access->momentum(c, p);
  fprintf(f, "%d %d %d\n", n, access->generalized_jacobian(c, "tip", J), access->generalized_jacobian(c, "no", J));
  for (i = 0; i < n * n; ++i) fprintf(f, "%.17g ", H[i]);
  for (i = 0; i < n; ++i) fprintf(f, "%.17g ", C[i]);
  for (i = 0; i < 6; ++i) fprintf(f, "%.17g ", p[i]);
  for (i = 0; i < 6 * m; ++i) fprintf(f, "%.17g ", J[i]);
  for (i = 0; i < 3; ++i) fprintf(f, "%.17g ", in->base_position[i]);
  for (i = 0; i < 4; ++i) fprintf(f, "%.17g ", in->base_quaternion_wxyz[i]);
  for (i = 0; i < 3; ++i) fprintf(f, "%.17g ", in->base_velocity[i]);
  for (i = 0; i < 3; ++i) fprintf(f, "%.17g ", in->base_angular_velocity[i]);
  fprintf(f, "\n");
  fclose(f);
}

static int update(void* made, const grapnel_controller_input* in, const grapnel_controller_access* access,
                  grapnel_controller_output* out) {
  instance* own = made;
  int j;
  for (j = 0; j < in->joints; ++j) own->sum += in->position[j];
  if (!strcmp(own->does, "fails") && in->time > 0.1) return 3;
  if (!strcmp(own->does, "nan")) out->effort[in->joints - 1] = NAN;
  if (!strcmp(own->does, "crashes")) *(volatile int*)(size_t)8 = 1;
  if (!strcmp(own->does, "aborts")) abort();
  if (!strcmp(own->does, "asks")) query(own, in, access);
  return 0;
}

static size_t save(void* made, void* bytes, size_t count) {
  if (count >= sizeof(double)) memcpy(bytes, &((instance*)made)->sum, sizeof(double));
  return sizeof(double);
}

static int restore(void* made, const void* bytes, size_t count) {
  if (count != sizeof(double)) return 1;
  memcpy(&((instance*)made)->sum, bytes, count);
  return 0;
}

static void destroy(void* made) { free(made); }
static const char* last_error(void* made) { return ((instance*)made)->does[0] == 'f' ? "the sun is out" : ""; }

static const grapnel_controller_plugin plugin = {sizeof(plugin), TEST_VERSION, create, reset,
#ifdef TEST_NO_UPDATE
                                                 NULL,
#else
                                                 update,
#endif
                                                 save, restore, destroy, last_error};

#ifdef TEST_NO_SYMBOL
__attribute__((visibility("default"))) int (*unused)(void*, const grapnel_controller_input*,
                                                     const grapnel_controller_access*,
                                                     grapnel_controller_output*) = update;
__attribute__((visibility("default"))) const void* unused_plugin = &plugin;
#else
const grapnel_controller_plugin* grapnel_controller(void) {
  (void)update;
  return &plugin;
}
#endif
