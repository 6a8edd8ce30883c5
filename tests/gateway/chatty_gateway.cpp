// A gateway that says a line in each round of its loop, and writes "sent" to standard output for
// each sample that it sends.
//
//   chatty_gateway MAPPING…
//   chatty_gateway last-words    says something, writes "said", and ends itself
//   chatty_gateway flood         says more than may wait, writes "said", waits for the end of its
//                                standard input
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "gateway/core/program.hpp"
#include "gateway/core/say.hpp"
#include "logging/log_writer.hpp"

namespace {

using namespace arbiter::gateway;

void print(const char* line) {
  std::puts(line);
  std::fflush(stdout);
}

class PrintingSender : public Sender {
 public:
  [[nodiscard]] Result send(arbiter::Bytes /*sample*/) noexcept override {
    print("sent");
    return Result::kSent;
  }
};

class ChattyMiddleware : public Middleware {
 public:
  Sender& sender(const Gateway&, const Entry&, Account&) override { return sender_; }
  void start(const std::vector<OpenIn>&, const std::vector<OpenOut>&) override {}
  void stop() noexcept override {}
  void tend() override { say(Level::kWarning, "one more round"); }

 private:
  PrintingSender sender_;
};

int flood() {
  const std::string line(1000, 'x');
  for (std::size_t said = 0; said < 2 * arbiter::logging::LogWriter::kMaxWaiting;) {
    say(Level::kInfo, line);
    said += line.size();
  }
  print("said");
  while (std::getchar() != EOF) {
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc == 2 ? argv[1] : "";
  if (what == "last-words") {
    say(Level::kError, what);
    print("said");
    finish_saying();
    std::_Exit(3);
  }
  if (what == "flood") return flood();
  const ProgramKind kind{Kind::kDds, "chatty-gateway", "Says a line in each round.", ""};
  return run_program(argc, argv, kind, [](const Settings&, const Bell&) {
    return std::make_unique<ChattyMiddleware>();
  });
}
