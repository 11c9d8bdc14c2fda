#include "base/stop_poll.h"

#include <gtest/gtest.h>

namespace cistern {
namespace {

TEST(StopPoll, AsksOnItsOwnThreadAlone) {
  int asked = 0;
  bool answer = false;
  StopPoll poll([&] {
    ++asked;
    return answer;
  });
  EXPECT_FALSE(poll());
  EXPECT_FALSE(poll());  // too soon to ask again
  EXPECT_EQ(asked, 1);
  answer = true;
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  std::thread([&] { EXPECT_FALSE(poll()); }).join();
  EXPECT_EQ(asked, 1);
  EXPECT_TRUE(poll());
  std::thread([&] { EXPECT_TRUE(poll()); }).join();
  answer = false;
  EXPECT_TRUE(poll());  // for good
  EXPECT_EQ(asked, 2);
}

TEST(StopPoll, WithoutAQuestionNothingStops) {
  StopPoll poll({});
  EXPECT_FALSE(poll());
}

}  // namespace
}  // namespace cistern
