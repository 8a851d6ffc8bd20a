/// Ten thousand random impacts, in parts that run beside each other.

#include <gtest/gtest.h>

#include "impact/contact_case.hpp"

namespace grapnel::testing {
namespace contact_thousands_test {

class ContactThousands : public ::testing::TestWithParam<int> {};

TEST_P(ContactThousands, StrongeNeverGainsEnergyAndKeepsTheCone) { check_stronge(GetParam(), GetParam() + 1250, 1); }

INSTANTIATE_TEST_SUITE_P(From, ContactThousands, ::testing::Range(0, 10000, 1250));

}  // namespace contact_thousands_test
}  // namespace grapnel::testing
