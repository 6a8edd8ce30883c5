// Questions to a link, where its answer does not arrive whole.
#include "wire/link_call.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <cstdlib>
#include <string>

#include "shm/segment.hpp"
#include "tests/support/descriptor_limit.hpp"
#include "tests/support/temporary_directory.hpp"
#include "wire/messages.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::wire {
namespace {

// An answer without its document would be taken for a refusal without a reason.
TEST(LinkCall, SaysThatNoDescriptorIsLeftForTheAnswer) {
  const test::TemporaryDirectory directory;
  ::setenv("RUNTIME_DIRECTORY", directory.path().c_str(), 1);
  const Listener listener = listen_as_link(directory.path(), "here");
  LinkCall call("here");
  const shm::FileDescriptor link(::accept4(listener.socket.get(), nullptr, nullptr, SOCK_CLOEXEC));
  ::unsetenv("RUNTIME_DIRECTORY");
  // What bears a descriptor, and a byte: as the beginning of any answer.
  Message answer;
  const shm::FileDescriptor document = shm::make_segment("document", 1);
  ASSERT_EQ(send_message(link.get(), answer, {document.get(), -1}), SendResult::kSent);
  const test::NoDescriptors none;
  std::string why;
  try {
    static_cast<void>(call.ask({"", "hosts"}));
  } catch (const CallError& error) {
    why = error.what();
  }
  EXPECT_NE(why.find("has no descriptor left for what the link sends"), std::string::npos) << why;
}

}  // namespace
}  // namespace arbiter::wire
