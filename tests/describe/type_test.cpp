#include "grapnel/describe/type.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace grapnel {
namespace {

enum class Colour { red, green };

struct Envelope {
  double position = 0.5;
  std::optional<double> angle;
  Colour colour = Colour::red;
  std::vector<bool> determined;
  Vector3d axis{1, 2, 3};
  Quaterniond attitude;
};

struct Gripper : Envelope {
  std::vector<Envelope> others;
};

}  // namespace

template <>
struct Described<Colour> {
  static constexpr Choice choices[] = {choice(Colour::red, "red"), choice(Colour::green, "green", "Like grass.")};
  static constexpr Type type = enumeration<Colour>("Colour", choices);
};
template <>
struct Described<Envelope> {
  static constexpr Field fields[] = {
      field<&Envelope::position>("position", "m", "Largest distance.").at_least(0),
      field<&Envelope::angle>("angle", "rad", "Largest angle; absent: no limit."),
      field<&Envelope::colour>("colour", "Of the gripper."),
      field<&Envelope::determined>("determined", "Per component."),
      field<&Envelope::axis>("axis", "1", "Of approach."),
      field<&Envelope::attitude>("quaternion_wxyz", "1", "Of the frame."),
      derived<[](const Envelope& e) { return 2 * e.position; }>("width", "m", "Of the whole envelope.")
          .when<[](const Envelope& e) { return e.position < 1; }>(),
  };
  static constexpr Type type = structure<Envelope>("Envelope", "Capture envelope of an end-effector.", fields);
};
template <>
struct Described<Gripper> {
  static constexpr Field fields[] = {field<&Gripper::others>("others", "More of them.")};
  static constexpr Type type = structure<Gripper>("Gripper", "", fields);
};

namespace {

const Field& field_of(const Type& type, std::string_view key) {
  const Field* field = field_named(type, key);
  if (!field) throw std::logic_error("no such field");
  return *field;
}

double number_in(const Field& field, const void* owner) {
  double number = NAN;
  const auto take = [&](const void* value) { number = *static_cast<const double*>(value); };
  field.show(owner, visitor_of(take));
  return number;
}

TEST(Type, ReachesMembersByTheirKeys) {
  Envelope envelope;
  const Field& position = field_of(type_of<Envelope>(), "position");
  EXPECT_EQ(number_in(position, &envelope), 0.5);
  *static_cast<double*>(position.place(&envelope)) = 0.25;
  EXPECT_EQ(envelope.position, 0.25);
  EXPECT_EQ(position.unit, "m");
  EXPECT_TRUE(position.range.contains(0));
  EXPECT_FALSE(position.range.contains(-1e-300));
  EXPECT_EQ(field_named(type_of<Envelope>(), "positions"), nullptr);
}

TEST(Type, ComputesDerivedFields) {
  Envelope envelope;
  const Field& width = field_of(type_of<Envelope>(), "width");
  EXPECT_EQ(number_in(width, &envelope), 1);
  EXPECT_EQ(width.place, nullptr);
  EXPECT_TRUE(width.is_present(&envelope));
  envelope.position = 1;
  EXPECT_FALSE(width.is_present(&envelope));
}

TEST(Type, FillsAndEmptiesOptionals) {
  Envelope envelope;
  const Type& type = field_of(type_of<Envelope>(), "angle").type();
  ASSERT_EQ(type.kind, Type::Kind::optional);
  EXPECT_EQ(type.size(&envelope.angle), 0U);
  type.resize(&envelope.angle, 1);
  *static_cast<double*>(type.item(&envelope.angle, 0)) = 3;
  EXPECT_EQ(envelope.angle, 3);
  type.resize(&envelope.angle, 1);
  EXPECT_EQ(envelope.angle, 3);
  type.resize(&envelope.angle, 0);
  EXPECT_EQ(envelope.angle, std::nullopt);
}

TEST(Type, HoldsOneOfSeveralTypes) {
  std::variant<double, std::vector<double>> value = 2.5;
  const Type& type = type_of<decltype(value)>();
  ASSERT_EQ(type.kind, Type::Kind::alternatives);
  ASSERT_EQ(type.alternatives.size(), 2U);
  EXPECT_EQ(type.alternatives[0]().kind, Type::Kind::real);
  EXPECT_EQ(type.size(&value), 0U);
  EXPECT_EQ(*static_cast<double*>(type.item(&value, 0)), 2.5);
  type.resize(&value, 1);
  ASSERT_EQ(type.size(&value), 1U);
  static_cast<std::vector<double>*>(type.item(&value, 1))->assign({1, 2});
  double sum = 0;
  const auto add = [&](const void* held) {
    for (const double x : *static_cast<const std::vector<double>*>(held)) sum += x;
  };
  type.show_item(&value, 1, visitor_of(add));
  EXPECT_EQ(sum, 3);
}

TEST(Type, KnowsTheNamesOfEnumerations) {
  Envelope envelope;
  const Type& type = field_of(type_of<Envelope>(), "colour").type();
  EXPECT_EQ(name_of_choice(type, type.whole(&envelope.colour)), "red");
  type.set_whole(&envelope.colour, choice_named(type, "green").value());
  EXPECT_EQ(envelope.colour, Colour::green);
  EXPECT_EQ(name_of(Colour::green), "green");
  EXPECT_EQ(choice_named(type, "blue"), std::nullopt);
  EXPECT_THROW(name_of(static_cast<Colour>(7)), std::logic_error);
}

TEST(Type, WalksOverLists) {
  Gripper gripper;
  gripper.determined = {true, false};
  const Type& bools = type_of<std::vector<bool>>();
  std::vector<bool> seen;
  const auto take = [&](const void* value) { seen.push_back(*static_cast<const bool*>(value)); };
  for (std::size_t i = 0; i < bools.size(&gripper.determined); ++i)
    bools.show_item(&gripper.determined, i, visitor_of(take));
  EXPECT_EQ(seen, gripper.determined);

  const Type& list = field_of(type_of<Gripper>(), "others").type();
  list.resize(&gripper.others, 2);
  ASSERT_EQ(gripper.others.size(), 2U);
  const Type& item = list.of();
  EXPECT_EQ(item.name, "Envelope");
  *static_cast<double*>(field_of(item, "position").place(list.item(&gripper.others, 1))) = 7;
  EXPECT_EQ(gripper.others[1].position, 7);

  const Type& vector = type_of<Vector3d>();
  EXPECT_EQ(vector.fixed_size, 3U);
  EXPECT_EQ(*static_cast<double*>(vector.item(&gripper.axis, 2)), 3);
  const Type& quaternion = type_of<Quaterniond>();
  *static_cast<double*>(quaternion.item(&gripper.attitude, 3)) = 0.5;
  EXPECT_EQ(gripper.attitude.z, 0.5);
}

}  // namespace
}  // namespace grapnel
