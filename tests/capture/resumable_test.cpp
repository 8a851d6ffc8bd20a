/// The coroutine on which a capture's sequence is built.

#include "grapnel/capture/phase_segment.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace grapnel::testing {
namespace resumable_test {

// Something that is needed; its answer is what awaiting it gives.
struct Question : Resumable<Question>::Stop {
  explicit Question(int the_number) : number(the_number) {}
  int await_resume() const {
    if (!answer) throw std::runtime_error("no answer");
    return *answer;
  }
  int number;
  std::unique_ptr<int> answer;
};

struct Record {
  std::vector<int> answers;
  std::string failure;
  int alive = 0;
};

// Alive as long as the body is where it is.
struct Guard {
  explicit Guard(Record& the_record) : record(the_record) { ++record.alive; }
  ~Guard() { --record.alive; }
  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;
  Record& record;
};

Resumable<Question> asks(Record& record, const int& times) {
  const Guard outer(record);
  try {
    for (int i = 0; i < times; ++i) {
      const Guard inner(record);
      Question question(i);
      const int answer = co_await question;
      record.answers.push_back(answer);
    }
  } catch (const std::runtime_error& error) {
    record.failure = error.what();
  }
  if (times == 0) throw std::invalid_argument("nothing to ask");
}

TEST(Resumable, SuspendsAndResumesWithAnswer) {
  Record record;
  const int times = 3;
  Resumable<Question> body = asks(record, times);
  EXPECT_EQ(record.alive, 0);  // nothing happens before it is asked
  while (Question* question = body.next()) {
    EXPECT_EQ(record.alive, 2);
    question->answer = std::make_unique<int>(10 * question->number);
  }
  EXPECT_TRUE(body.done());
  EXPECT_EQ(body.next(), nullptr);
  EXPECT_EQ(record.answers, (std::vector<int>{0, 10, 20}));
  EXPECT_EQ(record.alive, 0);
}

TEST(Resumable, ExceptionAtResumptionReachesBody) {
  Record record;
  const int times = 2;
  Resumable<Question> body = asks(record, times);
  ASSERT_NE(body.next(), nullptr);
  EXPECT_EQ(body.next(), nullptr);  // without an answer
  EXPECT_EQ(record.failure, "no answer");
  EXPECT_EQ(record.alive, 0);
}

TEST(Resumable, ExceptionFromBodyReachesCaller) {
  Record record;
  const int times = 0;
  Resumable<Question> body = asks(record, times);
  EXPECT_THROW(body.next(), std::invalid_argument);
  EXPECT_TRUE(body.done());
  EXPECT_EQ(body.next(), nullptr);
  EXPECT_EQ(record.alive, 0);
}

TEST(Resumable, DestructorFreesSuspendedFrame) {
  Record record;
  const int times = 2;
  {
    Resumable<Question> first = asks(record, times);
    ASSERT_NE(first.next(), nullptr);
    Resumable<Question> body = std::move(first);
    EXPECT_EQ(record.alive, 2);
  }
  EXPECT_EQ(record.alive, 0);
  { const Resumable<Question> never_begun = asks(record, times); }
  EXPECT_EQ(record.alive, 0);
}

}  // namespace resumable_test
}  // namespace grapnel::testing
