#include "grapnel/spatial/sine_cosine.hpp"

namespace grapnel::sine_cosine_detail {

SineCosine<double> unreduced(double angle) { return {std::sin(angle), std::cos(angle)}; }

}  // namespace grapnel::sine_cosine_detail
