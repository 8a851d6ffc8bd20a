// A plugin that ends or disturbs the program. The environment variable GRAPNEL_TEST_END states where and how, such as
// "destroy exit".
#include <fenv.h>
#include <pthread.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

#include "grapnel/plugin/grapnel_controller.h"

namespace {

volatile int sink = 0;

int deeper(int depth) {
  volatile char frame[4096];
  frame[0] = static_cast<char>(depth);
  sink = frame[0];
  return depth < 0 ? 0 : deeper(depth + 1) + frame[0];
}

void* exit_apart(void*) { std::exit(0); }

void end(const std::string& how) {
  if (how == "exit") std::exit(0);
  if (how == "_exit") ::_exit(0);
  if (how == "quick_exit") std::quick_exit(0);
  if (how == "overflow") sink = deeper(0);
  if (how == "crash") ::raise(SIGSEGV);
  if (how == "kill") ::kill(::getpid(), SIGKILL);
  if (how == "throw") throw std::runtime_error("not meant to leave");
  if (how == "folder") sink = ::chdir("/");
  if (how == "rounding") fesetround(FE_UPWARD);
  if (how == "traps") feenableexcept(FE_INEXACT);
  if (how == "thread") {
    pthread_t thread;
    pthread_create(&thread, nullptr, exit_apart, nullptr);
    pthread_join(thread, nullptr);
  }
}

void at(const char* where) {
  const char* const requested = std::getenv("GRAPNEL_TEST_END");
  const std::string text = requested ? requested : "", wanted = std::string(where) + " ";
  if (text.compare(0, wanted.size(), wanted) == 0) end(text.substr(wanted.size()));
}

int create(const grapnel_controller_setup*, void** instance, char*, std::size_t) {
  *instance = std::malloc(1);
  at("create");
  return 0;
}

int update(void*, const grapnel_controller_input*, const grapnel_controller_access*, grapnel_controller_output*) {
  at("update");
  return 0;
}

void destroy(void* instance) {
  std::free(instance);
  at("destroy");
}

struct Loaded {
  Loaded() { at("load"); }
  ~Loaded() { at("unload"); }
} loaded;

grapnel_controller_plugin functions() {
  grapnel_controller_plugin table{};
  table.size = sizeof table;
  table.version = GRAPNEL_CONTROLLER_VERSION;
  table.create = create, table.update = update, table.destroy = destroy;
  return table;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const grapnel_controller_plugin* grapnel_controller() {
  static const grapnel_controller_plugin table = functions();
  return &table;
}
