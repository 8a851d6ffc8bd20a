/// The promise on ten thousand random impacts.

#include <gtest/gtest.h>

#include "impact/contact_case.hpp"

namespace grapnel::testing {
namespace contact_thousands_test {

TEST(ContactThousands, StrongeNeverGainsEnergyAndKeepsTheCone) { check_stronge(10000, 1); }

}  // namespace contact_thousands_test
}  // namespace grapnel::testing
