#include "pd_model.h"

#include <string.h>

ExtU_pd_model_T pd_model_U;
ExtY_pd_model_T pd_model_Y;
DW_pd_model_T pd_model_DW;
P_pd_model_T pd_model_P = {20.0, 60.0, 0.5};

void pd_model_initialize(void) {
  memset(&pd_model_DW, 0, sizeof(pd_model_DW));
  memset(&pd_model_Y, 0, sizeof(pd_model_Y));
}

void pd_model_step(void) {
  int i;
  for (i = 0; i < PD_MODEL_JOINTS; i++) {
    pd_model_DW.Filter_DSTATE[i] = pd_model_P.Filter_Pole * pd_model_DW.Filter_DSTATE[i] +
                                   (1.0 - pd_model_P.Filter_Pole) * pd_model_U.rate[i];
    pd_model_Y.torque[i] = pd_model_P.Kp * (pd_model_U.reference[i] - pd_model_U.position[i]) -
                           pd_model_P.Kd * pd_model_DW.Filter_DSTATE[i];
  }
}
