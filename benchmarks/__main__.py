"""`python -m benchmarks`: all benchmarks, one after the other."""

from benchmarks.stepping import main

raise SystemExit(main())
