#pragma once

/// @file
/// A made-up run with every kind of shape, for the tests of figures and of glTF.

#include "grapnel/report/run_data.hpp"

namespace grapnel::test {

/// A base, two links (one without a shape), a target that turns by `spin` [rad/s] about a tilted axis; 101 samples
/// before an impact, two at it, 101 after it. `odd` is part of the names of bodies and joints. Planar: all motion stays
/// in z = 0.
RunSource sample_run(bool planar, const std::string& odd = "", double spin = 1.7);

}  // namespace grapnel::test
