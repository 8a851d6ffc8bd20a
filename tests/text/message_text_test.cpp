// Terminal control characters become '?'; other characters are unchanged.
#include <gtest/gtest.h>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace message_text_test {

TEST(Printable, TextStaysAsItIs) {
  for (const char* text : {"", "arm-1 [rad]", "α Δ größer 腕 🛰", "e\u0301", "\u00a0", "שלום"}) {
    EXPECT_EQ(printable_line(text), text);
    EXPECT_EQ(printable_lines(text), text);
  }
  EXPECT_EQ(printable_lines("a\tb\nc\n"), "a\tb\nc\n");
}

TEST(Printable, ControlCharactersDoNot) {
  EXPECT_EQ(printable_line("a\tb\nc"), "a?b?c");
  EXPECT_EQ(printable_lines("\x1b[31m\x1b]0;title\a\r\b\x7f"), "?[31m?]0;title????");
  EXPECT_EQ(printable_lines(std::string_view("a\0b", 3)), "a?b");
  EXPECT_EQ(printable_lines("\u009b31m\u0080\u009f"), "?31m??");           // C1
  EXPECT_EQ(printable_lines("a\u202eb\u2066c\u2028d\u2069"), "a?b?c?d?");  // text direction, line separators
  EXPECT_EQ(printable_lines("\x9b"
                            "31m \xff \xc3 \xe2\x82"),
            "?31m ? ? ??");  // invalid or truncated UTF-8
}

TEST(Printable, Utf8) {
  EXPECT_EQ(utf8_length("a", 0), 1u);
  EXPECT_EQ(utf8_length("é", 0), 2u);
  EXPECT_EQ(utf8_length("é", 1), 0u);
  EXPECT_EQ(utf8_length("🛰", 0), 4u);
  EXPECT_EQ(utf8_length("\xc0\x80", 0), 0u);      // overlong
  EXPECT_EQ(utf8_length("\xed\xa0\x80", 0), 0u);  // a surrogate
}

}  // namespace message_text_test
}  // namespace grapnel
