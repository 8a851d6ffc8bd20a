#include "grapnel/text/error_text.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <new>
#include <stdexcept>

namespace grapnel {
namespace {

TEST(ErrorText, ReplacesMessagesOfTheStandardLibrary) {
  EXPECT_EQ(error_text(std::bad_alloc()), "there is not enough memory");
  EXPECT_EQ(error_text(std::length_error("vector::_M_default_append")), "there is not enough memory");
  const std::filesystem::filesystem_error file("filesystem error: cannot get file size", "a/b",
                                               std::make_error_code(std::errc::no_such_file_or_directory));
  EXPECT_EQ(error_text(file), "cannot use 'a/b': No such file or directory");
}

TEST(ErrorText, PreservesOtherMessages) {
  EXPECT_EQ(error_text(std::runtime_error("arm: no motion")), "arm: no motion");
}

}  // namespace
}  // namespace grapnel
