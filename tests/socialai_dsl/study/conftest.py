from tests.socialai_dsl.study.participants import place

__all__ = ["place"]
