// Asks the daemon what it alone knows: its status, about once a second, and why somebody wins.
//
// On a thread of its own, with a conversation of its own: a daemon that is stopped, or slow, holds
// up neither the screen nor a key.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "top/frame.hpp"
#include "watch/instance.hpp"
#include "watch/model_loader.hpp"

namespace arbiter::top {

// Runs on the inquirer's thread; what it throws is the answer. If it is asked to stop, nobody reads
// the answer any more.
using ExplainWhy = std::function<std::string(const std::shared_ptr<watch::Instance>&,
                                             const std::shared_ptr<watch::ModelLoader>&,
                                             const WhyQuestion&, const std::stop_token&)>;

class Inquirer {
 public:
  // `instance`: nobody else may use it from now on. Throws std::system_error.
  Inquirer(std::shared_ptr<watch::Instance> instance, ExplainWhy explain);
  Inquirer(const Inquirer&) = delete;
  Inquirer& operator=(const Inquirer&) = delete;
  // Asks the question that is under way to stop, and waits until it has: a second at most where the
  // daemon does not answer, as long as one port takes where the model is large.
  ~Inquirer();

  // Any thread.

  // Readable when there is news.
  [[nodiscard]] int descriptor() const noexcept { return bell_.get(); }
  // Of several questions that have not been put yet, the last counts.
  void ask(WhyQuestion question);
  struct News {
    std::shared_ptr<const Census> census;  // null: none since the last time
    std::optional<WhyReply> why;
    std::string problem;     // why there is no census now; "": there is one
    bool is_silent = false;  // for the daemon does not answer
  };
  [[nodiscard]] News take_news();

 private:
  void run(const std::stop_token& stop);
  void take_census();
  void answer(const WhyQuestion& question, const std::stop_token& stop);
  void tell(const std::function<void(News&)>& write);

  const std::shared_ptr<watch::Instance> instance_;
  const std::shared_ptr<watch::ModelLoader> models_;  // keeps the model for the next question
  const ExplainWhy explain_;
  shm::FileDescriptor bell_;
  std::optional<StampedStatus> last_;  // the thread's
  std::mutex mutex_;                   // guards what follows
  std::condition_variable_any asked_;
  std::optional<WhyQuestion> question_;
  News news_;
  std::jthread thread_;  // last: it uses all of these
};

}  // namespace arbiter::top
