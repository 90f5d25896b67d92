"""What the tests of another package need: suites that it must pass, matches, commands, pages and drives on a bench.

A suite is of a driver, rule book, strategy, motor protocol or window. A package outside VRG subclasses one, gives it
what it asks for by a fixture, and has every test of it:

    from vrg.testing.driver import DriverBench, DriverContract

    class TestMyDriver(DriverContract):
        @pytest.fixture
        def bench(self): ...

All of it needs pytest, which the extra `testing` of VRG brings. docs/plugins.md lists the modules.
"""
