/*
 * A custom controller for Grapnel: a shared library with one exported function, grapnel_controller(), which returns a
 * table of functions. Plain C without link dependencies; docs/how-to/own-controller.md is a guide.
 *
 * Units are SI and radians. W is the scenario's world frame, B the base's frame. Strings are UTF-8 and
 * null-terminated. Every structure begins with its size in bytes, from the compilation of the side that filled it:
 * later versions add members at the end, so a member may be read if the size includes it.
 *
 * Threads: campaigns run many instances in parallel. Several threads call functions of different instances
 * simultaneously; one thread at a time calls those of one instance, not always the same thread. Keep all state in the
 * instance that create() makes, not in static variables.
 */
#ifndef GRAPNEL_CONTROLLER_H
#define GRAPNEL_CONTROLLER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(_WIN32)
#define GRAPNEL_CONTROLLER_EXPORT __declspec(dllexport)
#else
#define GRAPNEL_CONTROLLER_EXPORT __attribute__((visibility("default")))
#endif

/* The version of this interface. Grapnel refuses plugins with another version. */
#define GRAPNEL_CONTROLLER_VERSION 1u

/* The input of create(). Valid during the call. */
typedef struct grapnel_controller_setup {
  size_t size;
  const char* parameters; /* control.parameters of the scenario as a JSON object; "{}" if not stated */
  const char* model;      /* the robot as JSON: {"base": {"name", "is_free"}, "joints": [{"name", "type", "body",
                             "parent", "lower", "upper", "rate", "effort"}, ...], "bodies": [{"name", "parent", "mass",
                             "com", "inertia": [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]}, ...], "end_effectors": [name, ...]};
                             absent limits are null. All arrays below have the order of its joints. */
  int joints;             /* number of joints */
  double period;          /* between updates [s] */
  double delay;           /* from an update to the start of its command [s] */
  int base_torque;        /* 1: the plugin commands the base's torque; 0: its torque is ignored */
} grapnel_controller_setup;

/* The input of a controller at a sample: readings of the scenario's sensors, and true values for quantities without a
   sensor. Valid during the call. */
typedef struct grapnel_controller_input {
  size_t size;
  double time;            /* of the scenario [s] */
  int piece;              /* index in the run, from 0; increases when grasps close or open, which changes masses */
  int joints;             /* number of joints: the length of the following arrays */
  const double* position; /* measured by the joints' sensors, with noise [rad or m] */
  const double* rate;     /* likewise [rad/s or m/s] */
  const double* desired_position;     /* reference of the joints [rad or m] */
  const double* desired_rate;         /* [rad/s or m/s] */
  const double* desired_acceleration; /* [rad/s^2 or m/s^2] */
  double base_position[3];            /* of B's origin, in W [m] */
  double base_quaternion_wxyz[4];     /* R_WB, of unit norm */
  double base_velocity[3];            /* of B's origin, in W [m/s] */
  double base_angular_velocity[3];    /* of B, in B's axes [rad/s] */
  /* The rest is present if `size` includes it. Values without a sensor are NaN. */
  int end_effectors;    /* number, in the order of the robot's JSON */
  const double* wrench; /* 6 of each: force and torque of its target on it, in its axes, about its origin [N], [N m] */
  int wheels;           /* reaction wheels, in the robot's order */
  const double* wheel_rate;    /* relative to the base; true values without a sensor [rad/s] */
  int targets;                 /* number, in the scenario's order */
  const double* target_pose;   /* 7 of each: position of its frame in B [m], quaternion w, x, y, z of R_BT */
  const double* target_motion; /* 6 of each, in B's axes: velocity of its origin less that of B's [m/s], angular
                                  velocity in W [rad/s] */
} grapnel_controller_input;

/* The output of a controller. All values are zero on call. */
typedef struct grapnel_controller_output {
  size_t size;
  double* effort;        /* of each joint [N m or N]; Grapnel limits it to the joint's limit */
  double base_torque[3]; /* on the base, in B's axes [N m] */
} grapnel_controller_output;

/*
 * Queries of the true model during update(): of the servicer and all held targets, in their current state. Order of
 * velocities: six of the base [angular; linear] in B at B's origin, then the joints, then those of joints that grasps
 * have made (hinges and points); a base fixed to the world has none of the six. Pass `context` unchanged. Functions
 * return 0, or 1 for an unknown frame.
 */
typedef struct grapnel_controller_access {
  size_t size;
  const void* context;
  int (*velocities)(const void* context);             /* N: number of velocities */
  int (*mass_matrix)(const void* context, double* H); /* N x N, row by row, rotors included */
  int (*bias)(const void* context, double* C);        /* N: forces at zero acceleration, gravity included */
  int (*momentum)(const void* context, double* p);    /* 6: [angular about the centre of mass; linear] in W */
  int (*generalized_jacobian)(const void* context, const char* frame, double* J); /* of an end-effector, by name:
                                                                 6 x (N - 6) (fixed base: 6 x N), row by row; twist
                                                                 [angular; linear] in W at zero momentum */
} grapnel_controller_access;

/* A plugin. Functions that return int return 0 on success; any other value ends the run, with the message of
   last_error(). */
typedef struct grapnel_controller_plugin {
  size_t size;
  uint32_t version; /* GRAPNEL_CONTROLLER_VERSION */
  /* Creates an instance and stores it in *instance. On failure it writes the reason to `error`, at most `error_size`
     bytes including the final 0; destroy() is then not called. */
  int (*create)(const grapnel_controller_setup* setup, void** instance, char* error, size_t error_size);
  /* A run begins at `time` [s]: resets the state of the instance. May be null. */
  int (*reset)(void* instance, double time);
  /* A sample. */
  int (*update)(void* instance, const grapnel_controller_input* input, const grapnel_controller_access* access,
                grapnel_controller_output* output);
  /* Writes the state of the instance to `bytes` if `count` suffices; returns the required number. May be null. */
  size_t (*save)(void* instance, void* bytes, size_t count);
  /* Restores the state that save() wrote. May be null if save is. */
  int (*restore)(void* instance, const void* bytes, size_t count);
  void (*destroy)(void* instance);
  /* The reason of the last failure of this instance; valid until its next call. May be null. */
  const char* (*last_error)(void* instance);
} grapnel_controller_plugin;

/* The only exported function. Its result is constant and valid while the library is loaded. */
GRAPNEL_CONTROLLER_EXPORT const grapnel_controller_plugin* grapnel_controller(void);

#ifdef __cplusplus
}
#endif

#endif
