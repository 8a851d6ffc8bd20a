#include "grapnel/integrate/manifold.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "grapnel/integrate/dormand_prince_853.hpp"

namespace grapnel {
namespace manifold_test {

using ::testing::HasSubstr;
using Vector = std::vector<double>;

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::invalid_argument& fault) {
    return fault.what();
  }
  return "nothing thrown";
}

TEST(Manifold, NormalizesEveryQuaternionAndNothingElse) {
  const Manifold manifold{.size = 10, .quaternions = {1, 6}};
  Vector y = {7.0, 1.0, 1.0, 1.0, 1.0, -3.0, 0.0, 0.5, 0.0, 0.0};
  EXPECT_DOUBLE_EQ(normalize(manifold, std::span<double>(y)), 1.0);  // norms 2 and 0.5
  EXPECT_EQ(y, (Vector{7.0, 0.5, 0.5, 0.5, 0.5, -3.0, 0.0, 1.0, 0.0, 0.0}));
  EXPECT_EQ(normalize(manifold, std::span<double>(y)), 0.0);
}

TEST(Manifold, DefectsBelowAndAboveOneAndNanAreReported) {
  const Manifold manifold{.size = 8, .quaternions = {0, 4}};
  Vector y = {0.75, 0, 0, 0, 1.125, 0, 0, 0};
  EXPECT_DOUBLE_EQ(normalize(manifold, std::span<double>(y)), 0.25);
  y[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(normalize(manifold, std::span<double>(y))));
}

TEST(Manifold, ErrorsAreNamed) {
  EXPECT_NO_THROW(validate({.size = 12, .quaternions = {8, 0}, .controlled = 8}));
  EXPECT_THAT(message_of([] { validate({.size = -1}); }), HasSubstr("size is -1"));
  EXPECT_THAT(message_of([] { validate({.size = 6, .quaternions = {3}}); }),
              HasSubstr("quaternion at offset 3 lies outside a state of 6"));
  EXPECT_THAT(message_of([] { validate({.size = 6, .quaternions = {-1}}); }), HasSubstr("quaternion at offset -1"));
  EXPECT_THAT(message_of([] { validate({.size = 9, .quaternions = {4, 1}}); }), HasSubstr("overlaps the one at 1"));
  EXPECT_THAT(message_of([] { validate({.size = 9, .quaternions = {3}, .controlled = 5}); }), HasSubstr("straddles"));
  EXPECT_THAT(message_of([] { validate({.size = 9, .controlled = 10}); }), HasSubstr("controlled is 10"));
}

TEST(ErrorNorm, RefusesBadTolerances) {
  const Manifold manifold{.size = 3};
  const auto message = [&](const Tolerances& t) { return message_of([&] { ErrorNorm<double>(manifold, t); }); };
  EXPECT_THAT(message({.rtol = -1.0}), HasSubstr("rtol"));
  EXPECT_THAT(message({.atol = 0.0}), HasSubstr("absolute tolerance must be positive"));
  EXPECT_THAT(message({.atol_components = {1.0, 1.0}}), HasSubstr("2 entries for a state of 3"));
  EXPECT_THAT(message({.atol_components = {1.0, 1.0, std::nan("")}}), HasSubstr("absolute tolerance must be positive"));
}

TEST(ErrorNorm, OrdinaryNumbersByTheirMagnitude) {
  const ErrorNorm<double> norm({.size = 2}, {.rtol = 0.1, .atol_components = {1.0, 2.0}});
  const Vector y0 = {10.0, -5.0}, y1 = {-30.0, 0.0}, difference = {8.0, 5.0};
  EXPECT_EQ(norm.dimension(), 2);
  EXPECT_DOUBLE_EQ(norm.sum_of_squares(y0, y1, difference), 2.0 * 2.0 + 2.0 * 2.0);  // 8/(1+3), 5/(2+0.5)
}

// A rotation by a small vector costs the same in every orientation; a change of norm costs nothing.
TEST(ErrorNorm, QuaternionsByTheirRotationVector) {
  const ErrorNorm<double> norm({.size = 4, .quaternions = {0}}, {.rtol = 0.0, .atol = 1.0});
  EXPECT_EQ(norm.dimension(), 3);
  for (const double angle : {0.0, 1e-8, 1.0, 3.14159}) {
    const double c = std::cos(0.5 * angle), s = std::sin(0.5 * angle) / 3.0;
    const Vector q = {c, s, 2.0 * s, 2.0 * s};
    // δq = q ⊗ (0, e/2) with e = (0.03, −0.02, 0.06), whose length is 0.07
    const double e[3] = {0.015, -0.01, 0.03};
    const Vector d = {-q[1] * e[0] - q[2] * e[1] - q[3] * e[2], q[0] * e[0] + q[2] * e[2] - q[3] * e[1],
                      q[0] * e[1] + q[3] * e[0] - q[1] * e[2], q[0] * e[2] + q[1] * e[1] - q[2] * e[0]};
    EXPECT_NEAR(norm.sum_of_squares(q, q, d), 0.07 * 0.07, 1e-16);  // measured at most 8.7e-19
    EXPECT_LT(norm.sum_of_squares(q, q, q), 1e-30);                 // along the radius; measured at most 3.3e-33
    EXPECT_DOUBLE_EQ(norm.magnitude(q), 1.0);
  }
}

TEST(ErrorNorm, UncontrolledNumbersDoNotCount) {
  const Manifold manifold{.size = 11, .quaternions = {1, 6}, .controlled = 6};
  const ErrorNorm<double> norm(manifold, {.rtol = 0.0, .atol = 1.0});
  EXPECT_EQ(norm.dimension(), 5);
  const Vector y = {0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0};
  EXPECT_EQ(norm(y, Vector{0, 0, 0, 0, 0, 0, 9, 9, 9, 9, 9}), 0.0);
  EXPECT_DOUBLE_EQ(norm(y, Vector{3, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0}), std::sqrt(5.0));
  EXPECT_EQ(ErrorNorm<double>({.size = 2, .controlled = 0}, {})(Vector{1, 1}, Vector{1, 1}), 0.0);
}

TEST(Manifold, NumbersBesideRanges) {
  using Ranges = std::vector<NumberRange>;
  EXPECT_EQ(numbers_beside(5, Ranges{}), (Ranges{{0, 5}}));
  EXPECT_EQ(numbers_beside(9, Ranges{{0, 2}, {4, 5}, {5, 6}}), (Ranges{{2, 4}, {6, 9}}));
  EXPECT_EQ(numbers_beside(9, Ranges{{3, 9}}), (Ranges{{0, 3}}));
  EXPECT_EQ(numbers_beside(0, Ranges{}), Ranges{});
}

// Twenty numbers with a quaternion, more than one block of numbers and a rest.
TEST(ErrorNorm, SkipsZeroDifferencesAndTakesSeveralInOnePass) {
  const Manifold manifold{.size = 22, .quaternions = {10}, .controlled = 21};
  ErrorNorm<double> norm(manifold, {.rtol = 0.1, .atol = 0.5});
  Vector y(22), one(22), other(22);
  for (int i = 0; i < 22; ++i) y[i] = std::sin(i), one[i] = std::cos(3 * i), other[i] = 1.0 / (1 + i);
  normalize(manifold, std::span<double>(y));
  for (const int i : {0, 1, 5, 6, 7, 20}) one[i] = other[i] = 0;
  const double whole = norm(y, one), of_other = norm(y, other), magnitude = norm.magnitude(y);
  const auto expect_equal = [&] {
    EXPECT_EQ(norm(y, one), whole);
    EXPECT_EQ(norm.magnitude(y), magnitude);
    const auto [first, second] = norm.of_each<2>(y, {one, other});
    EXPECT_EQ(first, whole);
    EXPECT_EQ(second, of_other);
  };
  expect_equal();
  norm.skip(std::vector<NumberRange>{{0, 2}, {5, 8}, {20, 21}});
  expect_equal();
  one[6] = 100;  // skipped
  EXPECT_EQ(norm(y, one), whole);
  norm.skip({});
  EXPECT_GT(norm(y, one), 2 * whole);
}

}  // namespace manifold_test
}  // namespace grapnel
