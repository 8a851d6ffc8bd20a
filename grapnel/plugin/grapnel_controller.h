/*
 * A controller of your own for Grapnel: a shared library with one exported function, grapnel_controller(), which
 * returns a table of functions. Plain C, nothing to link with; docs/how-to/own-controller.md leads through it.
 *
 * Units are SI and radians. W is the scenario's world frame, B the base's frame. Strings are UTF-8 and end with 0. Every
 * structure begins with its size in bytes, as the side that filled it was compiled: later versions add members at the
 * end, so a member may be read if the size says that it is there.
 *
 * Threads: campaigns run many instances at the same time. Functions of different instances are called by several threads
 * at once, those of one instance by one thread at a time, not always the same one. What a plugin keeps belongs into the
 * instance that create() makes, not into static variables.
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

/* Of this interface. Grapnel refuses plugins with another one. */
#define GRAPNEL_CONTROLLER_VERSION 1u

/* What create() is told. Valid during the call. */
typedef struct grapnel_controller_setup {
  size_t size;
  const char* parameters; /* control.parameters of the scenario as JSON, an object; "{}" where it says none */
  const char* model;      /* the robot as JSON: {"base": {"name", "is_free"}, "joints": [{"name", "type", "body",
                             "parent", "lower", "upper", "rate", "effort"}, ...], "bodies": [{"name", "parent", "mass",
                             "com", "inertia": [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]}, ...], "end_effectors": [name, ...]};
                             limits that are not there are null. Its joints have the order of all arrays below. */
  int joints;             /* how many there are */
  double period;          /* between updates [s] */
  double delay;           /* from an update to the time from which on its command acts [s] */
  int base_torque;        /* 1: the base's torque is the plugin's to say; 0: what it says is not read */
} grapnel_controller_setup;

/* What a controller sees at a sample: what the scenario's sensors read, and the truth where it states none. Valid during
   the call. */
typedef struct grapnel_controller_input {
  size_t size;
  double time;                        /* of the scenario [s] */
  int piece;                          /* of the run, from 0; grows when grasps close or open: masses have changed */
  int joints;                         /* how many: the length of the arrays that follow */
  const double* position;             /* as the joints' sensors read it, noise included [rad or m] */
  const double* rate;                 /* likewise [rad/s or m/s] */
  const double* desired_position;     /* what the joints are to follow [rad or m] */
  const double* desired_rate;         /* [rad/s or m/s] */
  const double* desired_acceleration; /* [rad/s^2 or m/s^2] */
  double base_position[3];            /* of B's origin, in W [m] */
  double base_quaternion_wxyz[4];     /* R_WB, of unit norm */
  double base_velocity[3];            /* of B's origin, in W [m/s] */
  double base_angular_velocity[3];    /* of B, in B's axes [rad/s] */
  /* The rest is there if `size` says so. Numbers that no sensor reads are NaN. */
  int end_effectors;         /* how many, in the order of the robot's JSON */
  const double* wrench;      /* 6 of each: what it holds exerts on it, in its axes, about its origin [N], [N m]: force, torque */
  int wheels;                /* reaction wheels, in the robot's order */
  const double* wheel_rate;  /* relative to the base; the truth where no sensor reads them [rad/s] */
  int targets;               /* how many, in the scenario's order */
  const double* target_pose; /* 7 of each: position of its frame in B [m], quaternion w, x, y, z of R_BT */
  const double* target_motion; /* 6 of each, in B's axes: velocity of its origin less that of B's [m/s], angular velocity
                                  in W [rad/s] */
} grapnel_controller_input;

/* What it says. All is zero when it is asked. */
typedef struct grapnel_controller_output {
  size_t size;
  double* effort;        /* of each joint [N m or N]; Grapnel cuts it at the joint's limit */
  double base_torque[3]; /* on the base, in B's axes [N m] */
} grapnel_controller_output;

/*
 * What it may ask of the true model during update(): of the servicer and of all that it holds, as they now are.
 * Velocities are ordered so: six of the base [angular; linear] in B at B's origin, then the joints, then those of joints
 * that grasps have made (hinges and points); a base fixed to the world has none of the six. `context` is handed on as it
 * is. Functions return 0, or 1 for a frame that is not there.
 */
typedef struct grapnel_controller_access {
  size_t size;
  const void* context;
  int (*velocities)(const void* context);                     /* N: how many there are */
  int (*mass_matrix)(const void* context, double* H);         /* N x N, row by row, rotors included */
  int (*bias)(const void* context, double* C);                /* N: forces at zero acceleration, gravity included */
  int (*momentum)(const void* context, double* p);            /* 6: [angular about the centre of mass; linear] in W */
  int (*generalized_jacobian)(const void* context, const char* frame, double* J); /* of an end-effector, by name:
                                                                 6 x (N - 6) (fixed base: 6 x N), row by row; twist
                                                                 [angular; linear] in W at zero momentum */
} grapnel_controller_access;

/* A plugin. Functions that return int return 0 if all is well; anything else ends the run, and last_error() says why. */
typedef struct grapnel_controller_plugin {
  size_t size;
  uint32_t version; /* GRAPNEL_CONTROLLER_VERSION */
  /* Makes an instance and puts it at *instance. On failure it writes why into `error`, at most `error_size` bytes with
     the 0 at their end; nothing is then destroyed. */
  int (*create)(const grapnel_controller_setup* setup, void** instance, char* error, size_t error_size);
  /* A run begins at `time` [s]: whatever the instance remembers is forgotten. May be null. */
  int (*reset)(void* instance, double time);
  /* A sample. */
  int (*update)(void* instance, const grapnel_controller_input* input, const grapnel_controller_access* access,
                grapnel_controller_output* output);
  /* Writes all that the instance remembers into `bytes` if they are enough; returns how many it takes. May be null. */
  size_t (*save)(void* instance, void* bytes, size_t count);
  /* Takes back what save() wrote. May be null where save is. */
  int (*restore)(void* instance, const void* bytes, size_t count);
  void (*destroy)(void* instance);
  /* Why a function of this instance failed; valid until its next call. May be null. */
  const char* (*last_error)(void* instance);
} grapnel_controller_plugin;

/* The one exported function. What it returns is constant and lives as long as the library is loaded. */
GRAPNEL_CONTROLLER_EXPORT const grapnel_controller_plugin* grapnel_controller(void);

#ifdef __cplusplus
}
#endif

#endif
