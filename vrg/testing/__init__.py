"""Suites that a driver, rule book, strategy or motor protocol of another package must pass, to be run by pytest.

A package outside VRG subclasses a suite, gives it what it asks for by a fixture, and has every test of it:

    from vrg.testing.driver import DriverBench, DriverContract

    class TestMyDriver(DriverContract):
        @pytest.fixture
        def bench(self): ...

They need pytest, which the extra `testing` of VRG brings.
"""
