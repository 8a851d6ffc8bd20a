/*
 * Wraps generated code whose inputs, outputs and states are static (generated/pd_model.c). The process has one such set,
 * but a campaign has one instance per core. Each instance therefore stores its states, and copies them into the static
 * structures for a step under a lock. Code generated as reusable, with a structure for its states, needs no lock: the
 * structure is the instance.
 */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "generated/pd_model.h"
#include "grapnel/plugin/grapnel_controller.h"

static pthread_mutex_t model_lock = PTHREAD_MUTEX_INITIALIZER;

/* save() writes one structure of this type. */
typedef struct instance {
  DW_pd_model_T states;
} instance;

static int create(const grapnel_controller_setup* setup, void** made, char* error, size_t error_size) {
  instance* own;
  if (setup->joints != PD_MODEL_JOINTS) {
    snprintf(error, error_size, "the model was generated for %d joints, the robot has %d", PD_MODEL_JOINTS,
             setup->joints);
    return 1;
  }
  if (fabs(setup->period - PD_MODEL_STEP) > 1e-9 * PD_MODEL_STEP) {
    snprintf(error, error_size, "the model was generated for a period of %g s, control.period is %g s", PD_MODEL_STEP,
             setup->period);
    return 1;
  }
  own = calloc(1, sizeof(instance));
  if (!own) {
    snprintf(error, error_size, "no memory");
    return 1;
  }
  *made = own;
  return 0;
}

static int reset(void* made, double time) {
  instance* own = made;
  (void)time;
  pthread_mutex_lock(&model_lock);
  pd_model_initialize();
  own->states = pd_model_DW;
  pthread_mutex_unlock(&model_lock);
  return 0;
}

static int update(void* made, const grapnel_controller_input* in, const grapnel_controller_access* access,
                  grapnel_controller_output* out) {
  instance* own = made;
  (void)access;
  pthread_mutex_lock(&model_lock);
  pd_model_DW = own->states;
  memcpy(pd_model_U.reference, in->desired_position, sizeof(pd_model_U.reference));
  memcpy(pd_model_U.position, in->position, sizeof(pd_model_U.position));
  memcpy(pd_model_U.rate, in->rate, sizeof(pd_model_U.rate));
  pd_model_step();
  memcpy(out->effort, pd_model_Y.torque, sizeof(pd_model_Y.torque));
  own->states = pd_model_DW;
  pthread_mutex_unlock(&model_lock);
  return 0;
}

static size_t save(void* made, void* bytes, size_t count) {
  if (count >= sizeof(instance)) memcpy(bytes, made, sizeof(instance));
  return sizeof(instance);
}

static int restore(void* made, const void* bytes, size_t count) {
  if (count != sizeof(instance)) return 1;
  memcpy(made, bytes, count);
  return 0;
}

static void destroy(void* made) { free(made); }

const grapnel_controller_plugin* grapnel_controller(void) {
  static const grapnel_controller_plugin plugin = {
      sizeof(plugin), GRAPNEL_CONTROLLER_VERSION, create, reset, update, save, restore, destroy, NULL};
  return &plugin;
}
