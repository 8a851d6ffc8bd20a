// Steps of contact paths in packs for avx2. Compiled with special flags, see CMakeLists.txt.

#include "grapnel/impact/contact_path_kernel.hpp"
#include "grapnel/pack/pack.hpp"

namespace grapnel {

PathSteps* make_path_steps_avx2(int contacts) { return new_path_steps<lanes::Pack<lanes::Avx2>>(contacts); }

}  // namespace grapnel
