// The interface as its documentation shows it.
#include <chrono>
#include <span>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "position.hpp"

using namespace std::chrono_literals;

namespace {
void use(const Position& position) { require(position.x == 1, "the sample that was published"); }
}  // namespace

int main(int, char** argv) {
  arbiter::Node node("object-detector");
  arbiter::Node other("other", {.instance = argv[1]});
  auto out = node.output_port<Position>("/Object/pos:o");
  {
    auto any = node.input_port("/Arm/pos:i");
    out.publish(Position{1, 2, 3});
    auto s = any.take();
    require(s && s->size() == sizeof(Position), "untyped: accepts anything, gives bytes");
    const std::span<const std::byte> span = **s;
    require(span.size() == sizeof(Position), "a span");
  }
  auto in = node.input_port<Position>("/Arm/pos:i", {.depth = 4});
  if (auto loan = out.loan()) {
    (*loan)->x = 1;
    auto o = out.publish(std::move(*loan));
    require(o.delivered == 1 && o.discarded == 0, "how many input ports");
  }
  if (auto s = in.take()) use(**s);
  out.publish(Position{1, 2, 3});
  auto s = in.wait_for(100ms);
  require(static_cast<bool>(s), "a sample");
  use(**s);
  require(in.winner() == "/Object/pos:o", "the winner");
  out.signal();
  out.deactivate();
  require(in.idle(), "idle");
  require(in.fd() >= 0, "a descriptor");

  auto bytes = node.output_port("/Camera/image:o", {.max_size = 1 << 20});
  if (auto loan = bytes.loan(1 << 20)) {
    const std::span<std::byte> image = **loan;
    image[0] = std::byte{1};
    bytes.publish(std::move(*loan));
  }
  const std::byte few[3]{};
  bytes.publish({few, sizeof few});
  {
    const arbiter::Type type("geometry/Position", sizeof(Position), alignof(Position));
    auto by_name = node.output_port("/Script/pos:o", type, {.max_loans = 1});
    require(by_name.type() == arbiter::type_of<Position>(), "as the typed port has it");
    auto loan = by_name.loan(type.size());
    by_name.publish(std::move(*loan), std::chrono::steady_clock::now() + 1h);
    require(by_name.signal(arbiter::Time()).late, "late");
    auto any = node.input_port("/Script/pos:i", type, {.keep = true});
    require(any.type().alignment() == alignof(double), "its alignment");
  }
  auto reliable = node.input_port<Position>(
      "/Elsewhere", {.when_full = arbiter::refuse_new, .keep = true, .max_held = 2});
  require(reliable.name() == "/Elsewhere", "a name");
}
