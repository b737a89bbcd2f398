"""The grocery domain of the paper (Sec. 4.2): a shopping agent fills a basket and buys it."""

from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.profiles import load_profiles
from goalscope.envs.grocery.shop import GroceryShop

__all__ = ["Catalogue", "GroceryShop", "Item", "load_profiles"]
