// Steps of contact paths in packs for sse2. Compiled with special flags, see CMakeLists.txt.

#include "grapnel/impact/contact_path_kernel.hpp"
#include "grapnel/pack/pack.hpp"

namespace grapnel {

PathSteps* make_path_steps_sse2(int contacts) { return new_path_steps<lanes::Pack<lanes::Sse2>>(contacts); }

}  // namespace grapnel
