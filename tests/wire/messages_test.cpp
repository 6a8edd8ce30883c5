#include "wire/messages.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

namespace arbiter::wire {
namespace {

std::size_t open_descriptors() {
  std::size_t count = 0;
  DIR* const directory = opendir("/proc/self/fd");
  while (readdir(directory) != nullptr) ++count;
  closedir(directory);
  return count;
}

class Wire : public testing::Test {
 protected:
  Wire() {
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends), 0);
    sender_.reset(ends[0]);
    receiver_.reset(ends[1]);
  }

  // Sends bytes as they are, with copies of a descriptor.
  void send_raw(const void* bytes, std::size_t size, std::size_t descriptors = 0) const {
    iovec data{const_cast<void*>(bytes), size};
    msghdr header{};
    header.msg_iov = &data;
    header.msg_iovlen = 1;
    std::vector<std::byte> control(CMSG_SPACE(sizeof(int) * descriptors));
    if (descriptors != 0) {
      header.msg_control = control.data();
      header.msg_controllen = control.size();
      cmsghdr* const part = CMSG_FIRSTHDR(&header);
      part->cmsg_level = SOL_SOCKET;
      part->cmsg_type = SCM_RIGHTS;
      part->cmsg_len = CMSG_LEN(sizeof(int) * descriptors);
      const std::vector<int> copies(descriptors, sender_.get());
      std::memcpy(CMSG_DATA(part), copies.data(), sizeof(int) * descriptors);
    }
    ASSERT_GE(sendmsg(sender_.get(), &header, MSG_NOSIGNAL), 0);
  }
  ReceiveResult receive() { return receive_message(receiver_.get(), received_, false); }

  shm::FileDescriptor sender_;
  shm::FileDescriptor receiver_;
  Received received_;
};

TEST_F(Wire, AMessageArrivesAsItWasSent) {
  Message message;
  message.kind = MessageKind::kOpenOutput;
  message.flags = 3;
  message.request = 4;
  message.port = 5;
  message.peer = 6;
  message.id = 7;
  message.value = 8;
  message.type.set_name("Twist");
  message.type.size = 48;
  message.type.alignment = 16;
  message.set_name("/Face/pos:o");
  message.set_text("because");
  ASSERT_EQ(send_message(sender_.get(), message, {sender_.get(), receiver_.get()}),
            SendResult::kSent);
  ASSERT_EQ(receive(), ReceiveResult::kReceived);
  EXPECT_EQ(std::memcmp(&received_.message, &message, sizeof message), 0);
  EXPECT_EQ(received_.descriptor_count, 2u);
}

TEST_F(Wire, WhatAMessageLeavesOutIsEmptyWhateverCameBeforeIt) {
  Message first;
  first.set_name("/a");
  first.set_text("a long explanation");
  ASSERT_EQ(send_message(sender_.get(), first, {sender_.get(), -1}), SendResult::kSent);
  ASSERT_EQ(send_message(sender_.get(), Message{}), SendResult::kSent);
  ASSERT_EQ(receive(), ReceiveResult::kReceived);
  ASSERT_EQ(receive(), ReceiveResult::kReceived);
  EXPECT_TRUE(received_.message.name_view().empty());
  EXPECT_TRUE(received_.message.text_view().empty());
  EXPECT_EQ(received_.descriptor_count, 0u);
  EXPECT_FALSE(received_.descriptors[0]);
}

TEST_F(Wire, NamesAndTextsOfAnyLengthAreCutAndEnded) {
  const std::string endless(5000, 'x');
  Message message;
  message.set_name(endless);
  message.set_text(endless);
  message.type.set_name(endless);
  ASSERT_EQ(send_message(sender_.get(), message), SendResult::kSent);
  ASSERT_EQ(receive(), ReceiveResult::kReceived);
  EXPECT_EQ(received_.message.name_view().size(), shm::kMaxNameLength);
  EXPECT_EQ(received_.message.text_view().size(), sizeof message.text - 1);
  EXPECT_EQ(received_.message.type.type_name().size(), shm::kMaxTypeName);
}

TEST_F(Wire, ANameWithoutAnEndIsGivenOne) {
  Message message;
  std::memset(message.name, 'n', sizeof message.name);
  std::memset(message.text, 't', sizeof message.text);
  std::memset(message.type.name, 'y', sizeof message.type.name);
  send_raw(&message, sizeof message);
  ASSERT_EQ(receive(), ReceiveResult::kReceived);
  EXPECT_EQ(received_.message.name[sizeof message.name - 1], '\0');
  EXPECT_EQ(received_.message.text[sizeof message.text - 1], '\0');
  EXPECT_EQ(received_.message.type.name[shm::kMaxTypeName], '\0');
}

TEST_F(Wire, AMessageCutBeforeItsFixedPartEndsIsMalformed) {
  const Message message;
  for (std::size_t size = 1; size < offsetof(Message, type); ++size) {
    send_raw(&message, size);
    EXPECT_EQ(receive(), ReceiveResult::kMalformed) << size;
  }
  for (const std::size_t size : {offsetof(Message, type), offsetof(Message, type) + 1,
                                 offsetof(Message, name) + 3, sizeof message}) {
    send_raw(&message, size);
    EXPECT_EQ(receive(), ReceiveResult::kReceived) << size;
  }
}

TEST_F(Wire, AMessageThatIsTooLongIsMalformed) {
  const std::vector<std::byte> bytes(sizeof(Message) + 1);
  send_raw(bytes.data(), bytes.size());
  EXPECT_EQ(receive(), ReceiveResult::kMalformed);
}

TEST_F(Wire, DescriptorsThatWereNotAskedForAreClosed) {
  const std::size_t before = open_descriptors();
  const Message message;
  for (const std::size_t descriptors : {3u, 4u, 10u, 253u}) {
    send_raw(&message, sizeof message, descriptors);
    EXPECT_EQ(receive(), ReceiveResult::kMalformed) << descriptors;
  }
  send_raw(&message, 4, 2);
  EXPECT_EQ(receive(), ReceiveResult::kMalformed) << "too short, with descriptors";
  send_raw(&message, sizeof message, 2);
  EXPECT_EQ(receive(), ReceiveResult::kReceived);
  received_ = {};
  EXPECT_EQ(open_descriptors(), before);
}

TEST_F(Wire, DescriptorsOfAnEmptyMessageAreClosed) {
  const std::size_t before = open_descriptors();
  send_raw("", 0, 2);
  EXPECT_EQ(receive(), ReceiveResult::kClosed);
  received_ = {};
  EXPECT_EQ(open_descriptors(), before);
}

TEST_F(Wire, DescriptorsAreNotInheritedByAProgramThatIsStarted) {
  ASSERT_EQ(send_message(sender_.get(), {}, {sender_.get(), -1}), SendResult::kSent);
  ASSERT_EQ(receive(), ReceiveResult::kReceived);
  EXPECT_NE(fcntl(received_.descriptors[0].get(), F_GETFD) & FD_CLOEXEC, 0);
}

TEST_F(Wire, WithNothingToReceiveItDoesNotBlock) { EXPECT_EQ(receive(), ReceiveResult::kNothing); }

TEST_F(Wire, ASocketThatNobodyReadsGetsFullAndGoesOnLater) {
  SendResult result = SendResult::kSent;
  int sent = 0;
  while ((result = send_message(sender_.get(), {})) == SendResult::kSent) ++sent;
  EXPECT_EQ(result, SendResult::kFull);
  for (int i = 0; i < sent; ++i) EXPECT_EQ(receive(), ReceiveResult::kReceived);
  EXPECT_EQ(send_message(sender_.get(), {}), SendResult::kSent);
}

TEST_F(Wire, APeerThatIsGoneIsToldApartAndRaisesNoSignal) {
  receiver_.reset();
  EXPECT_EQ(send_message(sender_.get(), {}), SendResult::kClosed);
  EXPECT_EQ(receive_message(sender_.get(), received_, true), ReceiveResult::kClosed);
}

// The kernel says first that the other end left messages unread, and only then what it sent.
TEST_F(Wire, WhatWasSentBeforeHangingUpIsReadThoughTheSenderLeftMessagesUnread) {
  Message message;
  message.kind = MessageKind::kClosePort;
  ASSERT_EQ(send_message(sender_.get(), message), SendResult::kSent);
  ASSERT_EQ(send_message(receiver_.get(), message), SendResult::kSent);
  sender_.reset();
  Received received;
  EXPECT_EQ(receive_message(receiver_.get(), received, false), ReceiveResult::kReceived);
  EXPECT_EQ(received.message.kind, MessageKind::kClosePort);
  EXPECT_EQ(receive_message(receiver_.get(), received, false), ReceiveResult::kClosed);
}

TEST(Message, ATextThatIsTooLongForAMessageIsCutBetweenTwoCharacters) {
  Message message;
  std::string text(sizeof message.text - 2, 'x');
  message.set_text(text + "\u00e4\u00e4");
  EXPECT_EQ(message.text_view(), text);
  message.set_text(text + "y\u00e4");
  EXPECT_EQ(message.text_view(), text + "y");
}

// As a profiler's timer does it all the time.
TEST_F(Wire, SignalsDoNotPutOffForEverThatNobodyReads) {
  const timeval limit{kMaxWaitToSend, 0};
  ASSERT_EQ(setsockopt(sender_.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit), 0);
  while (send_message(sender_.get(), {}) == SendResult::kSent) {
  }
  ASSERT_EQ(fcntl(sender_.get(), F_SETFL, 0), 0) << "it blocks from now on";
  struct sigaction ignoring {};
  struct sigaction before {};
  ignoring.sa_handler = [](int) {};
  ASSERT_EQ(sigaction(SIGALRM, &ignoring, &before), 0);
  itimerval often{{0, 50'000}, {0, 50'000}};
  ASSERT_EQ(setitimer(ITIMER_REAL, &often, nullptr), 0);
  EXPECT_EQ(send_message(sender_.get(), {}), SendResult::kFull);
  often = {};
  setitimer(ITIMER_REAL, &often, nullptr);
  sigaction(SIGALRM, &before, nullptr);
}

}  // namespace
}  // namespace arbiter::wire
