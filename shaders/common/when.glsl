// A branch that llvmpipe takes as one: it runs both sides of every `if`, but skips a loop that no
// sample needs.
#define WHEN(condition) for (int taken = 0; taken < int(condition); ++taken)
