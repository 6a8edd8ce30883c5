// Looks, every two milliseconds, whether a statement about the instance has become true.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "rules/model/statement.hpp"
#include "watch/instance.hpp"

namespace arbiter::recorder {

class StatementWatch {
 public:
  // `came_true` is called on a thread of this, each time that the statement becomes true after it
  // was not; `say`, with why it cannot be judged, once for each reason.
  StatementWatch(const wire::Caller& caller, rules::Statement statement,
                 std::function<void()> came_true, std::function<void(const std::string&)> say);
  StatementWatch(const StatementWatch&) = delete;
  StatementWatch& operator=(const StatementWatch&) = delete;
  ~StatementWatch();

 private:
  void run();

  const rules::Statement statement_;
  const std::function<void()> came_true_;
  const std::function<void(const std::string&)> say_;
  const std::shared_ptr<watch::Instance> instance_;
  std::mutex mutex_;
  std::condition_variable stopping_;
  bool is_stopping_ = false;  // under the mutex
  std::thread thread_;
};

}  // namespace arbiter::recorder
