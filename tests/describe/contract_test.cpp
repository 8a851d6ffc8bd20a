// What is made of a description: the JSON document, its schema, its TypeScript types, its tables.
#include "grapnel/describe/contract.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "grapnel/describe/json.hpp"
#include "support/schema_check.hpp"

namespace grapnel {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

enum class Mood { calm, lively };

struct Row {
  std::string name;
  double value = 0;
};

struct Book {
  std::vector<Row> rows;
  Mood mood = Mood::lively;
  std::optional<double> absent, unknown;
  std::optional<Vector3d> way;
  double none = NAN;
  std::vector<Vector3d> axes = {{1, 2, 3}};
  std::array<std::string, 2> pair = {"a", "b"};
  bool hidden = true;
  std::vector<std::variant<double, std::string>> marks = {1.5, "torn"};
};

}  // namespace

template <>
struct Described<Mood> {
  static constexpr Choice choices[] = {choice(Mood::calm, "calm", "Sleeps."), choice(Mood::lively, "lively")};
  static constexpr Type type = enumeration<Mood>("Mood", choices);
};
template <>
struct Described<Row> {
  static constexpr Field fields[] = {field<&Row::value>("value", "m", "how far").at_least(0)};
  static constexpr Type type = structure<Row>("Row", "one of many.", fields);
};
template <>
struct Described<Book> {
  static constexpr Field fields[] = {
      field<&Book::rows>("NAME", "each row").keyed_by<&Row::name>(),
      field<&Book::mood>("mood", "of the reader."),
      field<&Book::absent>("absent", "s", "left out"),
      field<&Book::unknown>("unknown", "s", "not known").or_null(),
      field<&Book::way>("way", "1", "unit, or null").or_null(),
      field<&Book::none>("none", "kg", "a|b").or_null(),
      field<&Book::axes>("axes", "1", "unit"),
      field<&Book::pair>("pair", "of names"),
      field<&Book::hidden>("hidden", "unless wanted").when<[](const Book& b) { return !b.hidden; }>(),
      derived<[](const Book& b) { return !b.rows.empty(); }>("many", "", "whether there are several"),
      field<&Book::marks>("marks", "pages/*/marks"),
  };
  static constexpr Type type = structure<Book>("Book", "of rows.", fields);
};

namespace {

Book book() {
  Book b;
  b.rows = {{"first", 1}, {"second", 2}};
  return b;
}

TEST(Json, FollowsTheDescription) {
  Book b = book();
  EXPECT_EQ(json_of(b).dump(),
            R"({"first":{"value":1.0},"second":{"value":2.0},"mood":"lively","unknown":null,"way":null,"none":null,)"
            R"("axes":[[1.0,2.0,3.0]],"pair":["a","b"],"many":true,"marks":[1.5,"torn"]})");
  b.hidden = false, b.absent = 0.5, b.unknown = 2, b.way = {0, 0, 1}, b.none = 3;
  EXPECT_EQ(
      json_of(b).dump(),
      R"({"first":{"value":1.0},"second":{"value":2.0},"mood":"lively","absent":0.5,"unknown":2.0,"way":[0.0,0.0,1.0],"none":3.0,)"
      R"("axes":[[1.0,2.0,3.0]],"pair":["a","b"],"hidden":false,"many":true,"marks":[1.5,"torn"]})");
}

TEST(Schema, MatchesWrittenDocumentsExactly) {
  const test::SchemaCheck schema(json_schema(type_of<Book>(), "Book, version 1"));
  const auto written = [&] { return nlohmann::json::parse(json_of(book()).dump()); };
  EXPECT_THAT(schema.faults_of(written()), IsEmpty());
  const auto faults = [&](const char* pointer, const nlohmann::json& value) {
    nlohmann::json document = written();
    document[nlohmann::json::json_pointer(pointer)] = value;
    return schema.faults_of(document);
  };
  EXPECT_THAT(faults("/mood", "angry"), Not(IsEmpty()));
  EXPECT_THAT(faults("/mood", "calm"), IsEmpty());
  EXPECT_THAT(faults("/absent", nullptr), Not(IsEmpty()));
  EXPECT_THAT(faults("/absent", 1), IsEmpty());
  EXPECT_THAT(faults("/axes/0", {1, 2}), Not(IsEmpty()));
  EXPECT_THAT(faults("/way", {0, 0, 1}), IsEmpty());
  EXPECT_THAT(faults("/way", {0, 0, nullptr}), Not(IsEmpty()));
  EXPECT_THAT(faults("/pair", {"a"}), Not(IsEmpty()));
  EXPECT_THAT(faults("/marks", {"a", 1}), IsEmpty());
  EXPECT_THAT(faults("/marks", {"a", true}), Not(IsEmpty()));
  EXPECT_THAT(faults("/first/value", -1), Not(IsEmpty()));
  EXPECT_THAT(faults("/third", {{"value", 1}}), IsEmpty());
  EXPECT_THAT(faults("/third", {{"values", 1}}), Not(IsEmpty()));
  nlohmann::json document = written();
  document.erase("many");
  EXPECT_THAT(schema.faults_of(document), Not(IsEmpty()));
}

TEST(Typescript, HasTheSameKeys) {
  EXPECT_EQ(typescript_types(type_of<Book>(), "made of Book"), R"(// made of Book

export type FieldNote = readonly [key: string, unit: string, text: string];

// of rows.
export interface Book {
  /** of the reader. */
  mood: Mood;
  /** left out [s] */
  absent?: number;
  /** not known [s] */
  unknown: number | null;
  /** unit, or null [1] */
  way: [number, number, number] | null;
  /** a|b [kg] */
  none: number | null;
  /** unit [1] */
  axes: [number, number, number][];
  /** of names */
  pair: [string, string];
  /** unless wanted */
  hidden?: boolean;
  /** whether there are several */
  many: boolean;
  /** pages/*\/marks */
  marks: (number | string)[];
  /** each row */
  [NAME: string]: Row | Mood | number | number | null | [number, number, number] | null | [number, number, number][] | [string, string] | boolean | (number | string)[];
}
export const kBook: FieldNote[] = [
  ["mood","","of the reader."],
  ["absent","s","left out"],
  ["unknown","s","not known"],
  ["way","1","unit, or null"],
  ["none","kg","a|b"],
  ["axes","1","unit"],
  ["pair","","of names"],
  ["hidden","","unless wanted"],
  ["many","","whether there are several"],
  ["marks","","pages/*/marks"],
];

// one of many.
export interface Row {
  /** how far [m] */
  value: number;
}
export const kRow: FieldNote[] = [
  ["value","m","how far"],
];

export type Mood = "calm" | "lively";
)");
}

TEST(Tables, AreRemadeInTheirPlaces) {
  const std::string table = markdown_table(type_of<Book>());
  EXPECT_THAT(table, HasSubstr("`Book`: of rows.\n\n| Key | Type | Unit | Meaning |\n|---|---|---|---|\n"
                               "| *NAME* | `Row` |  | each row |\n"
                               "| `mood` | `calm` or `lively` |  | of the reader. `calm`: Sleeps. |\n"
                               "| `absent`? | number | s | left out |\n"
                               "| `unknown` | number or null | s | not known |\n"
                               "| `way` | vector or null | 1 | unit, or null |\n"
                               "| `none` | number or null | kg | a\\|b |\n"
                               "| `axes` | vectors | 1 | unit |\n"
                               "| `pair` | 2 texts |  | of names |\n"));
  EXPECT_THAT(table, HasSubstr("| `marks` | numbers or texts |  | pages/*/marks |\n"));
  const std::string page =
      "# Books\n\n<!-- table Book -->\nold\n<!-- end of table -->\nProse.\n\n<!-- table Row -->\n"
      "<!-- end of table -->\n";
  const std::string remade = page_with_tables(page, type_of<Book>());
  EXPECT_EQ(remade, "# Books\n\n<!-- table Book -->\n" + table +
                        "<!-- end of table -->\nProse.\n\n<!-- table Row -->\n" + markdown_table(type_of<Row>()) +
                        "<!-- end of table -->\n");
  EXPECT_EQ(page_with_tables(remade, type_of<Book>()), remade);
  EXPECT_THROW(page_with_tables("no place", type_of<Book>()), std::runtime_error);
  EXPECT_THROW(page_with_tables(page + page, type_of<Book>()), std::runtime_error);
}

}  // namespace
}  // namespace grapnel
