/// Two thousand random impacts out of ten thousand, in parts that run beside each other.

#include <gtest/gtest.h>

#include "impact/contact_case.hpp"

namespace grapnel::testing {
namespace contact_thousands_test {

class ContactThousands : public ::testing::TestWithParam<int> {};

TEST_P(ContactThousands, StrongeDissipatesAndKeepsCone) { check_stronge(GetParam(), GetParam() + 2500, 5); }

INSTANTIATE_TEST_SUITE_P(From, ContactThousands, ::testing::Range(0, 10000, 2500));

}  // namespace contact_thousands_test
}  // namespace grapnel::testing
