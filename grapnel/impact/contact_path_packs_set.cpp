// Steps of contact paths in packs for one instruction set, GRAPNEL_LANE_SET. Compiled once per set
// (cmake/GrapnelLanes.cmake).

#include "grapnel/impact/contact_path_kernel.hpp"
#include "grapnel/spatial/pack.hpp"

namespace grapnel {

template <class Set>
PathSteps* make_path_steps_of(int contacts) {
  return new_path_steps<lanes::Pack<Set>>(contacts);
}

template PathSteps* make_path_steps_of<lanes::GRAPNEL_LANE_SET>(int);

}  // namespace grapnel
