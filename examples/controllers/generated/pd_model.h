/*
 * Example of generated code, in the style of Simulink Coder with its default, nonreusable interface:
 * inputs, outputs, parameters and states are global structures, and a step is a function without arguments.
 */
#ifndef PD_MODEL_H
#define PD_MODEL_H

#define PD_MODEL_JOINTS 6
#define PD_MODEL_STEP 0.01 /* the base rate for which it was generated [s] */

typedef struct {
  double reference[PD_MODEL_JOINTS];
  double position[PD_MODEL_JOINTS];
  double rate[PD_MODEL_JOINTS];
} ExtU_pd_model_T;
typedef struct {
  double torque[PD_MODEL_JOINTS];
} ExtY_pd_model_T;
typedef struct {
  double Filter_DSTATE[PD_MODEL_JOINTS]; /* state of a first-order rate filter */
} DW_pd_model_T;
typedef struct {
  double Kp, Kd, Filter_Pole;
} P_pd_model_T;

extern ExtU_pd_model_T pd_model_U;
extern ExtY_pd_model_T pd_model_Y;
extern DW_pd_model_T pd_model_DW;
extern P_pd_model_T pd_model_P;

void pd_model_initialize(void);
void pd_model_step(void);

#endif
