// Zero copy is zero copy: a sample of 4 MiB is written once and read in place by every winner.
//
// "In place" is meant literally. The kernel names, for every address of a process, the file behind
// it and the offset in that file; a publisher's loan and its receivers' samples name the same bytes
// of the same file. And a byte that the publisher writes late is there for receivers that took the
// sample before: no copy could tell it.
#include <gtest/gtest.h>

#include <cstring>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

static_assert(sizeof(Image) == 4u << 20);

// Publishes one more, and lets the receiver take all that it has: whether it reads the last where
// it was written.
bool reads_in_place(OutputPort<Image>& out, Component& receiver) {
  auto loan = out.loan();
  (*loan)->bytes[0] = 7;
  const std::string written = where(loan->get()) + " 7";
  out.publish(std::move(*loan));
  std::string last;
  for (std::string next; (next = receiver.tell("look-at-next 0")) != "none";) last = next;
  return last == written;
}

// Until each place that a sample can be in has had one.
void wait_until_all_is_read_in_place(OutputPort<Image>& out, Component& receiver) {
  for (int in_a_row = 0; in_a_row < 64;)
    in_a_row = reads_in_place(out, receiver) ? in_a_row + 1 : 0;
}

// A receiver may be told to look what its publisher has allocated before the publisher has
// allocated it: then it copies, until it has looked again by itself.
TEST(ZeroCopy, AReceiverThatIsToldToLookTooEarlyDoesNotCopyForEver) {
  Daemon daemon(single_model());
  Node node("camera", {.service_thread = false});
  auto out = node.output_port<Image>("/out");
  Component receiver("receiver");
  ASSERT_EQ(receiver.tell("images-in /in"), "open");
  node.service();  // only now it allocates what the receiver needs
  wait_until_all_is_read_in_place(out, receiver);
}

TEST(ZeroCopy, EveryWinnerReadsTheSampleWhereThePublisherWroteIt) {
  Daemon daemon(fan_out_model(2));
  // Its service thread might be later than the opening of the receivers, on a machine that is busy:
  // then it delivers to one, and its receivers copy what it allocates later.
  Node node("camera", {.service_thread = false});
  auto out = node.output_port<Image>("/out");
  Component receivers[2] = {Component("first"), Component("second")};
  ASSERT_EQ(receivers[0].tell("images-in /in0"), "open");
  ASSERT_EQ(receivers[1].tell("images-in /in1"), "open");
  node.service();
  for (Component& receiver : receivers) wait_until_all_is_read_in_place(out, receiver);
  while (receivers[0].tell("look-at-next 0") != "none") {  // what came for the other
  }

  auto loan = out.loan();
  ASSERT_TRUE(loan);
  Image* const image = loan->get();
  std::memset(image, 1, sizeof *image);
  image->bytes[123456] = 42;
  const std::string written_at = where(image);
  EXPECT_NE(written_at, "nowhere");
  EXPECT_EQ(out.publish(std::move(*loan)).delivered, 2u);
  for (Component& receiver : receivers) {
    EXPECT_EQ(receiver.tell("look 123456"), written_at + " 42");
  }
  // Against the rules, and that is the point: who reads it now reads the publisher's own bytes.
  image->bytes[123456] = 43;
  for (Component& receiver : receivers) {
    EXPECT_EQ(receiver.tell("look 123456"), written_at + " 43");
  }
}

TEST(ZeroCopy, ALoanIsMemoryOfTheSegmentAndPublishingMovesItNowhere) {
  Daemon daemon(single_model());
  Node node("camera");
  auto out = node.output_port<Image>("/out");
  auto in = node.input_port<Image>("/in");
  for (int i = 0; i < 20; ++i) {
    auto loan = out.loan();
    ASSERT_TRUE(loan);
    const std::string written_at = where(loan->get());
    EXPECT_EQ(out.publish(std::move(*loan)).delivered, 1u);
    const auto sample = in.take();
    ASSERT_TRUE(sample);
    EXPECT_EQ(where(sample->get()), written_at);
  }
}

// A large sample is written to memory that may be in the cache still.
TEST(ZeroCopy, ALargeSampleIsWrittenWhereTheLastOneWasOnceThatIsDoneWith) {
  Daemon daemon(single_model());
  Node node("camera");
  auto out = node.output_port<Image>("/out");
  auto in = node.input_port<Image>("/in", {.max_held = 2});
  const auto publish = [&](unsigned char value) {
    auto loan = out.loan();
    Image* const image = loan->get();
    image->bytes[0] = value;
    out.publish(std::move(*loan));
    return image;
  };
  const Image* const first = publish(1);
  ASSERT_TRUE(in.take());
  EXPECT_EQ(publish(2), first);
  const auto held = in.take();
  ASSERT_TRUE(held);
  const Image* const second = publish(3);
  EXPECT_NE(second, first) << "a sample is held there";
  EXPECT_NE(publish(4), second) << "a sample waits there";
  EXPECT_EQ((*held)->bytes[0], 2);
  for (const int value : {3, 4}) {
    const auto sample = in.take();
    ASSERT_TRUE(sample);
    EXPECT_EQ((*sample)->bytes[0], value);
  }
}

TEST(ZeroCopy, UntypedSamplesAreReadInPlaceToo) {
  Daemon daemon(single_model());
  Node node("camera");
  auto out = node.output_port("/out", {.max_size = std::size_t{1} << 20});
  auto in = node.input_port("/in");
  auto loan = out.loan(std::size_t{1} << 20);
  ASSERT_TRUE(loan);
  const std::string written_at = where(loan->data());
  out.publish(std::move(*loan));
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ(where(sample->data()), written_at);
}

TEST(ZeroCopy, ReceiversCannotWriteWhatTheyRead) {
  Daemon daemon(single_model());
  Node node("camera");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  out.publish(Number{1});
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  const auto address = reinterpret_cast<std::uintptr_t>(sample->get());
  std::ifstream maps("/proc/self/maps");
  std::string access;
  for (std::string line; std::getline(maps, line);) {
    std::istringstream fields(line);
    std::uintptr_t begin = 0;
    std::uintptr_t end = 0;
    char dash = 0;
    std::string found;
    fields >> std::hex >> begin >> dash >> end >> found;
    if (begin <= address && address < end) access = found;
  }
  EXPECT_EQ(access, "r--s");
}

}  // namespace
}  // namespace arbiter::test
