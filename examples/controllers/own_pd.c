/*
 * A controller in C: PD control of the joints, and damping of the base rate if the scenario assigns the base torque to
 * the plugin (control.base_torque). Optional parameters: kp [N m/rad], kd [N m s/rad], base_kd [N m s/rad].
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "grapnel/plugin/grapnel_controller.h"

typedef struct controller {
  double kp, kd, base_kd;
  long updates; /* the complete state */
  char error[128];
} controller;

/* Returns the number at "key": in a JSON object, or `otherwise`. Suffices for parameters that are plain numbers; use a
   JSON library for others. */
static double number_at(const char* json, const char* key, double otherwise) {
  char quoted[64];
  const char* at;
  snprintf(quoted, sizeof(quoted), "\"%s\":", key);
  at = strstr(json, quoted);
  return at ? strtod(at + strlen(quoted), NULL) : otherwise;
}

static int create(const grapnel_controller_setup* setup, void** instance, char* error, size_t error_size) {
  controller* c = calloc(1, sizeof(controller));
  if (!c) {
    snprintf(error, error_size, "no memory");
    return 1;
  }
  c->kp = number_at(setup->parameters, "kp", 20);
  c->kd = number_at(setup->parameters, "kd", 60);
  c->base_kd = number_at(setup->parameters, "base_kd", 50);
  if (c->kp < 0 || c->kd < 0 || c->base_kd < 0) {
    snprintf(error, error_size, "kp, kd and base_kd must not be negative");
    free(c);
    return 1;
  }
  *instance = c;
  return 0;
}

static int reset(void* instance, double time) {
  (void)time;
  ((controller*)instance)->updates = 0;
  return 0;
}

static int update(void* instance, const grapnel_controller_input* in, const grapnel_controller_access* access,
                  grapnel_controller_output* out) {
  controller* c = instance;
  int j;
  (void)access; /* provides the mass matrix, for example */
  for (j = 0; j < in->joints; ++j) {
    out->effort[j] =
        c->kp * (in->desired_position[j] - in->position[j]) + c->kd * (in->desired_rate[j] - in->rate[j]);
  }
  for (j = 0; j < 3; ++j) out->base_torque[j] = -c->base_kd * in->base_angular_velocity[j];
  ++c->updates;
  return 0;
}

static size_t save(void* instance, void* bytes, size_t count) {
  const controller* c = instance;
  if (count >= sizeof(c->updates)) memcpy(bytes, &c->updates, sizeof(c->updates));
  return sizeof(c->updates);
}

static int restore(void* instance, const void* bytes, size_t count) {
  controller* c = instance;
  if (count != sizeof(c->updates)) {
    snprintf(c->error, sizeof(c->error), "%zu bytes are not what save() wrote", count);
    return 1;
  }
  memcpy(&c->updates, bytes, count);
  return 0;
}

static void destroy(void* instance) { free(instance); }

static const char* last_error(void* instance) { return ((controller*)instance)->error; }

const grapnel_controller_plugin* grapnel_controller(void) {
  static const grapnel_controller_plugin plugin = {
      sizeof(plugin), GRAPNEL_CONTROLLER_VERSION, create, reset, update, save, restore, destroy, last_error};
  return &plugin;
}
