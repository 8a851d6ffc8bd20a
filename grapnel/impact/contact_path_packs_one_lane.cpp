// Steps of contact paths in packs for one_lane. Compiled with special flags, see CMakeLists.txt.

#include "grapnel/impact/contact_path_kernel.hpp"
#include "grapnel/pack/pack.hpp"

namespace grapnel {

PathSteps* make_path_steps_one_lane(int contacts) { return new_path_steps<lanes::Pack<lanes::OneLane>>(contacts); }

}  // namespace grapnel
