// A component's connection to the daemon, and the maker of its ports.
//
// If the daemon dies, data continues to flow between the ports that are open. The node looks for a
// new daemon of the instance, about twenty times a second, and hands back its ports by itself. The
// service thread does this, or service() if there is none.
//
// Threads: several threads may use a node at once. Blocking: as each call says; call none of them
// from a thread with deadlines. Cost: opening a port takes three messages, some maps and
// allocations, typically below a millisecond; the service thread sleeps unless something comes or
// goes. Errors: arbiter::Error, which says what to do; nothing has been opened then. The paper:
// ports are those of section III, switch_model() of section V.
//
// In a forked child all calls throw arbiter::Error, except service_fd(), which returns -1.
#pragma once

#include <memory>
#include <string_view>
#include <type_traits>
#include <utility>

#include <arbiter/detail/cores.hpp>
#include <arbiter/input_port.hpp>
#include <arbiter/options.hpp>
#include <arbiter/output_port.hpp>
#include <arbiter/tap.hpp>
#include <arbiter/type.hpp>

namespace arbiter {

class Node {
 public:
  // Blocks until a daemon of the instance answers, at most options.connect_timeout; then throws
  // arbiter::Error. `name` is for people to read; several nodes may share one. It is 1 to 255 bytes
  // of UTF-8, without white space, double quotes, and control or invisible characters; and so is
  // the name of a port, which begins with '/'. Throws arbiter::Error if it is not.
  explicit Node(std::string_view name, const NodeOptions& options = {})
      : core_(detail::make_node(name, options)) {}
  // Copies belong to one component: it stays connected until the last copy and the last port go.
  Node(const Node&) = default;
  Node(Node&&) noexcept = default;
  Node& operator=(Node other) noexcept {
    core_.swap(other.core_);
    return *this;
  }
  // What goes last, a copy or a port, blocks until a callback that runs has returned; and for a
  // second or two if the daemon is there, but does not read.
  ~Node() { detail::drop_node(std::move(core_)); }

  // Opens an output port. Its name is the source of its connections. Blocks while the daemon
  // connects it with the input ports that are open, which takes below a millisecond, or up to 0.2 s
  // where a component at the other end does not run. Throws arbiter::Error: the name is taken or
  // malformed, an option is out of bounds, there is no memory, or no daemon has answered within
  // NodeOptions::connect_timeout.
  template <class T>
  [[nodiscard]] OutputPort<T> output_port(std::string_view name,
                                          const OutputPortOptions& options = {}) {
    if constexpr (std::is_void_v<T>) {
      return output_port(name, options);
    } else {
      return OutputPort<T>(detail::open_output(*core_, name, type_of<T>(), options));
    }
  }
  // One of a type that is known only now: its samples are bytes, type.size() of them each, or, of a
  // variable type, at most as many. To those at the other end it is as if a program had opened it
  // with the C++ type of that name.
  [[nodiscard]] OutputPort<void> output_port(std::string_view name, const Type& type,
                                             const OutputPortOptions& options = {}) {
    // Its constructor is explicit. NOLINTNEXTLINE(modernize-return-braced-init-list)
    return OutputPort<void>(detail::open_output(*core_, name, type, options));
  }
  // An untyped one, for samples of up to options.max_size bytes. Only untyped input ports take
  // them.
  [[nodiscard]] OutputPort<void> output_port(std::string_view name,
                                             const OutputPortOptions& options = {}) {
    return output_port(name, Type::untyped(options.max_size), options);
  }

  // Opens an input port; as for output_port().
  template <class T>
  [[nodiscard]] InputPort<T> input_port(std::string_view name,
                                        const InputPortOptions& options = {}) {
    if constexpr (std::is_void_v<T>) {
      return input_port(name, options);
    } else {
      return InputPort<T>(detail::open_input(*core_, name, type_of<T>(), options));
    }
  }
  // One that takes samples of this type alone, and gives them as bytes, type.size() of them each,
  // or, of a variable type, as many as each has.
  [[nodiscard]] InputPort<void> input_port(std::string_view name, const Type& type,
                                           const InputPortOptions& options = {}) {
    return InputPort<void>(detail::open_input(*core_, name, type, options));
  }
  // An untyped one: it takes samples of any type and size, and each says what it is
  // (Sample::type()).
  [[nodiscard]] InputPort<void> input_port(std::string_view name,
                                           const InputPortOptions& options = {}) {
    return input_port(name, Type::untyped(0), options);
  }

  // Watches an output port (or, with TapOptions::of, an input port) of any component: see tap.hpp.
  // Blocks as the opening of a port. The port need not be there yet. Throws arbiter::Error: the
  // name is malformed, an option is out of bounds, the policy does not allow this user to `tap` it,
  // the component that has the port open refuses because the tap does not fit or T is not what its
  // samples are, or no daemon has answered within NodeOptions::connect_timeout. A notice
  // (NoticeKind::refused) reports a source that comes later and refuses.
  template <class T>
  [[nodiscard]] Tap<T> tap(std::string_view name, const TapOptions& options = {}) {
    if constexpr (std::is_void_v<T>) {
      return tap(name, options);
    } else {
      return Tap<T>(detail::open_tap(*core_, name, type_of<T>(), options));
    }
  }
  // An untyped one, which gives bytes.
  [[nodiscard]] Tap<void> tap(std::string_view name, const TapOptions& options = {}) {
    return Tap<void>(detail::open_tap(*core_, name, Type::untyped(0), options));
  }

  // Puts another loaded model in force (arbiterd --model NAME=FILE): the same components form
  // another application (paper, section V). Returns when that is done: every publish() and take()
  // that begins afterwards, in any process, obeys the new model. All ports change at one instant;
  // no component is stopped. Choosing the model that is already in force changes nothing.
  //
  // Blocks while components take up the news: typically below a millisecond, up to 0.2 s if one of
  // them does not run, and as long as earlier reloads and switches take. Throws arbiter::Error if
  // there is no such model (the message lists the models that exist), if the policy does not allow
  // this user to `switch`, or if no daemon has answered within NodeOptions::connect_timeout (at
  // least a second); in that last case the model may still come into force. If the daemon dies
  // meanwhile, the next one is asked. Any thread may call it, but not on the data path: it
  // allocates, and talks to the daemon.
  void switch_model(std::string_view name) { detail::switch_model(*core_, name); }

  // Without a service thread: takes up the daemon's news, and calls on_notice on this thread. Maps
  // and allocates; does not wait for the daemon. With a service thread it does nothing.
  // service_fd() is readable when there is something to do; the node owns the descriptor.
  void service() { detail::service(*core_); }
  [[nodiscard]] int service_fd() const noexcept { return detail::service_fd(*core_); }

 private:
  std::shared_ptr<detail::NodeCore> core_;
};

}  // namespace arbiter
